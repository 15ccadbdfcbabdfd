"""Estimates of several models: folders of COLMAP models, and models in memory."""

import json

import numpy as np
import pycolmap
import pytest
from bs4 import BeautifulSoup
from scipy.spatial.transform import Rotation

from alignscores import Trajectory, evaluate
from alignscores.io import FileError, read_colmap
from alignscores.metrics import colmap_relative_auc
from tests.files import write_poses

METRICS = "auc@0.5:colmap", "auc@5:colmap", "auc@10:colmap-imc"


@pytest.fixture(scope="module")
def example(examples):
    """Reference and estimate of the example."""
    return [read_colmap(examples / "colmap" / name) for name in ("reference", "estimate")]


def parts_of(estimate, *parts):
    """The models of some rows of an estimate."""
    return {
        str(number): Trajectory(estimate.keys[rows], estimate.poses[rows])
        for number, rows in enumerate(parts)
    }


def test_a_folder_has_the_scores_of_its_best_model(run, example, tmp_path):
    """All images that are not in it are missing; the table names each model with its scores."""
    names, poses = example[1]
    parts = range(18), range(13, 35), range(3)
    for number, rows in enumerate(parts):
        write_poses["colmap"](tmp_path / f"sparse/{number}", names[rows], poses[rows])
    code, out, err = run("colmap", "colmap/reference", tmp_path / "sparse", "--json")
    (result,) = json.loads(out)["results"]
    documents = [
        json.loads(run("colmap", "colmap/reference", tmp_path / f"sparse/{part}", "--json")[1])
        for part in (1, 0)
    ]
    scores = [
        {name: document["results"][0][name] for name in ("TAS", "RAS", "PAS")}
        for document in documents
    ]
    assert {name: result[name] for name in scores[0]} == scores[0]
    assert result["models"] == [
        {"name": "1", "images": 22, "coverage": 0.55, **scores[0]},
        {"name": "0", "images": 18, "coverage": 0.45, **scores[1]},
        {"name": "2", "images": 3, "coverage": 0.075, **dict.fromkeys(scores[0])},
    ]
    assert code == 0
    assert "it has 3 models; scored is 1, and all images that it lacks are missing" in err
    table = run("colmap", "colmap/reference", tmp_path / "sparse")[1].splitlines()[-3:]
    assert [line.split()[1:4] for line in table] == [
        ["1", "22", "55.0%"],
        ["0", "18", "45.0%"],
        ["2", "3", "7.5%"],
    ]


def test_the_page_has_a_table_of_models(run, example, tmp_path):
    names, poses = example[1]
    for number, rows in enumerate((range(18), range(13, 35))):
        write_poses["colmap"](tmp_path / f"sparse/{number}", names[rows], poses[rows])
    page = tmp_path / "page.html"
    run("colmap", "colmap/reference", tmp_path / "sparse", "--save_page", page)
    (section,) = BeautifulSoup(page.read_text(), "html.parser").select("#section-1")
    assert section.h2.text == "Models of the estimates"
    rows = [[cell.text for cell in row.select("th, td")] for row in section.select("tbody tr")]
    assert [row[1:4] for row in rows] == [["1", "22", "55.0%"], ["0", "18", "45.0%"]]


def test_one_of_the_models(run, score, example, tmp_path):
    names, poses = example[1]
    for number, rows in enumerate((range(18), range(13, 35))):
        write_poses["colmap"](tmp_path / f"sparse/{number}", names[rows], poses[rows])
    sparse = tmp_path / "sparse"
    chosen, single = (
        score("colmap", "colmap/reference", sparse, "--model", 0)[0],
        score("colmap", "colmap/reference", sparse / "0")[0],
    )
    assert chosen["models"] == []
    assert {**chosen, "name": "", "file": ""} == {**single, "name": "", "file": ""}
    code, out, err = run("colmap", "colmap/reference", sparse, "--model", "7")
    assert (code, out) == (1, "")
    assert err.endswith("sparse: has no model '7': its models are 0, 1\n")
    err = run("colmap", "colmap/reference", "colmap/estimate", "--model", "0")[2]
    assert err.endswith("has no model '0': it is a single model\n")
    err = run("colmap", "colmap/reference", sparse, "--missing", "ignore")[2]
    assert "choose one with --model, such as 0" in err


def test_folders_of_one_model_are_that_model(score, example, tmp_path):
    """As sparse, with sparse/0 in it: as an estimate and as a reference."""
    for folder, trajectory in zip(("reference", "sparse"), example, strict=True):
        write_poses["colmap"](tmp_path / folder / "0", *trajectory)
    (result,) = score("colmap", tmp_path / "reference", tmp_path / "sparse")
    (expected,) = score("colmap", "colmap/reference", "colmap/estimate")
    assert result["models"] == []
    assert result["PAS"] == pytest.approx(expected["PAS"], abs=1e-3)  # written with fewer digits


def test_models_in_memory(example, examples):
    """As pycolmap's mappers return them."""
    names, _ = example[1]
    models = {}
    for number, rows in enumerate((range(25), range(17, 37))):
        models[number] = pycolmap.Reconstruction(str(examples / "colmap/estimate"))
        for image in list(models[number].images.values()):
            if image.name not in names[rows]:
                models[number].deregister_frame(image.frame_id)
    evaluation = evaluate(example[0], models)
    assert [(model.name, model.images) for model in evaluation.models] == [("0", 25), ("1", 20)]
    expected = evaluate(*example[:1], parts_of(example[1], range(25))["0"])
    assert evaluation.pas == pytest.approx(expected.pas, abs=1e-6)


def test_no_model_that_can_be_scored(example):
    with pytest.raises(ValueError, match="none of its 2 models can be scored; the largest one, 1,"):
        evaluate(example[0], parts_of(example[1], range(2), range(5, 8)))


def test_a_damaged_model_is_named(run, example, tmp_path):
    """It may be the best one."""
    for number in range(2):
        write_poses["colmap"](tmp_path / f"sparse/{number}", *example[1])
    (tmp_path / "sparse/1/images.bin").write_bytes(b"123")
    code, _, err = run("colmap", "colmap/reference", tmp_path / "sparse")
    assert code == 1
    assert "sparse/1/images.bin: is cut off" in err
    with pytest.raises(FileError):
        evaluate(tmp_path / "sparse/0", tmp_path / "sparse")


def relative_errors(gt, models, accuracy):
    """All errors of ordered pairs of images by their names, one after the other: brute force."""
    errors, pairs = [], set()
    for model in models:
        for first in model:
            for second in model:
                if first == second:
                    continue
                pairs.add((first, second))
                if first not in gt or second not in gt:
                    errors.append(180.0)
                    continue
                true, estimated = (np.linalg.inv(of[first]) @ of[second] for of in (gt, model))
                turn = Rotation.from_matrix(true[:3, :3].T @ estimated[:3, :3]).magnitude()
                steps = true[:3, 3], estimated[:3, 3]
                lengths = [np.linalg.norm(step) for step in steps]
                direction = np.arccos(np.clip(steps[0] @ steps[1] / np.prod(lengths), -1, 1))
                errors.append(np.degrees(max(turn, direction if lengths[0] >= accuracy else 0)))
    errors += [
        180.0 for first in gt for second in gt if first != second and (first, second) not in pairs
    ]
    return np.array(errors)


def area(errors, end, accuracy):
    """The area under the recall between 0 and an end in per cent: by the errors, each once."""
    below = int(np.sum(errors <= accuracy))
    at = [accuracy, *np.sort(errors[(errors > accuracy) & (errors <= end)])]
    recall = np.arange(below, below + len(at)) / len(errors)
    return 100 * (accuracy * recall[0] + np.trapezoid([*recall, recall[-1]], [*at, end])) / end


@pytest.mark.parametrize("seed", range(4))
def test_the_auc_of_colmap_counts_the_pairs_of_all_models(seed):
    """Pairs in several models once for each; pairs in none, and of registered outliers, fail."""
    rng = np.random.default_rng(seed)
    n = 14
    gt = np.tile(np.eye(4), (n, 1, 1))
    gt[:, :3, :3], gt[:, :3, 3] = Rotation.random(n, rng=rng).as_matrix(), rng.random((n, 3))
    names = np.array([f"{row:02}.png" for row in range(n)])
    models = {}
    for number in range(int(rng.integers(2, 5))):
        rows = rng.choice(n, int(rng.integers(4, n)), replace=False)
        poses = gt[rows].copy()
        noise = Rotation.from_rotvec(rng.normal(0, 0.03, (len(rows), 3))).as_matrix()
        poses[:, :3, :3] = noise @ poses[:, :3, :3]
        poses[:, :3, 3] += rng.normal(0, 0.02, (len(rows), 3))
        keys = names[rows]
        if number < seed:
            keys = np.append(keys, ["outlier", "another"])
            poses = np.concatenate([poses, gt[:2]])
        models[str(number)] = Trajectory(keys, poses)
    evaluation = evaluate(Trajectory(names, gt), models, metrics=METRICS)
    dicts = [dict(zip(*model, strict=True)) for model in models.values()]
    for name in METRICS:
        end = float(name.partition("@")[2].partition(":")[0])
        accuracy = 0.02 if "imc" in name else 0.001
        errors = relative_errors(dict(zip(names, gt, strict=True)), dicts, accuracy)
        assert evaluation.value(name) == pytest.approx(area(errors, end, accuracy), abs=1e-4)
    single = evaluate(Trajectory(names, gt), models["0"], metrics=METRICS)
    errors = relative_errors(dict(zip(names, gt, strict=True)), dicts[:1], 0.001)
    assert single.value("auc@5:colmap") == pytest.approx(area(errors, 5, 0.001), abs=1e-4)


def test_a_set_of_one_model_has_its_auc(example):
    gt = example[1].poses
    est = gt.copy()
    est[:, :3, 3] += np.random.default_rng(0).normal(0, 0.02, (len(gt), 3))
    assert colmap_relative_auc(gt, est[None], 5) == colmap_relative_auc(gt, est, 5)


def reconstruction(errors, n, rng):
    """Names, and true and estimated poses of a path: with noise and outliers, or with drift."""
    turns = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.1, (n, 3)), axis=0))
    gt = np.tile(np.eye(4), (n, 1, 1))
    gt[:, :3, :3] = turns.as_matrix()
    gt[:, :3, 3] = np.cumsum(turns.apply([1, 0, 0]) + rng.normal(0, 0.2, (n, 3)), axis=0)
    est, size = gt.copy(), rng.choice([0.02, 0.1, 0.3])
    position, angle = size * rng.normal(size=(n, 3)), size / 10 * rng.normal(size=(n, 3))
    if errors == "drift":
        position, angle = np.cumsum(position, axis=0), np.cumsum(angle, axis=0)
    est[:, :3, :3] = (Rotation.from_rotvec(angle) * turns).as_matrix()
    est[:, :3, 3] += position
    if errors == "random":
        wrong = rng.random(n) < 0.2
        est[wrong, :3, 3] += rng.normal(0, 10, (int(wrong.sum()), 3))
    return np.array([f"{row:03}.png" for row in range(n)]), gt, est


def cut(n, rng):
    """Rows of 2 to 6 models, one after the other or mixed, with and without shared images."""
    n_models = int(rng.integers(2, 7))
    order = np.arange(n) if rng.random() < 0.7 else rng.permutation(n)
    ends = np.sort(rng.choice(np.arange(4, n - 4), n_models - 1, replace=False))
    parts = np.split(order, ends)
    if rng.random() < 0.5:
        parts = [np.union1d(part, rng.choice(n, 3, replace=False)) for part in parts]
    if rng.random() < 0.3:
        parts += [order[row : row + 3] for row in range(0, n - 3, 3)]
    return parts


def moved(poses, rng):
    """The poses of a model in a coordinate frame of its own."""
    frame = Rotation.random(rng=rng)
    poses = poses.copy()
    poses[:, :3, :3] = frame.as_matrix() @ poses[:, :3, :3]
    poses[:, :3, 3] = rng.uniform(0.2, 5) * frame.apply(poses[:, :3, 3]) + rng.normal(size=3)
    return poses


@pytest.mark.parametrize("errors", ["random", "drift"])
@pytest.mark.parametrize("seed", range(8))
def test_splitting_does_not_raise_the_tas(errors, seed):
    rng = np.random.default_rng([seed, len(errors)])
    n = int(rng.integers(20, 80))
    names, gt, est = reconstruction(errors, n, rng)
    reference = Trajectory(names, gt)
    whole = evaluate(reference, Trajectory(names, est))
    models = {
        str(number): Trajectory(names[rows], moved(est[rows], rng))
        for number, rows in enumerate(cut(n, rng))
    }
    evaluation = evaluate(reference, models)
    assert evaluation.tas <= whole.tas + 0.002
    assert evaluation.ras <= whole.ras + 0.06  # its average is no maximum
    of_three = {
        str(row): Trajectory(names[row : row + 3], moved(est[row : row + 3], rng))
        for row in range(0, n - 3, 3)
    }
    with pytest.raises(ValueError, match="can be scored"):
        evaluate(reference, of_three)


def test_reconstructions_of_opensfm(run, score, example, tmp_path):
    """A list in one file, as OpenSfM writes it; the reference's largest one is read."""
    lists = []
    for names, poses in (example[0], parts_of(example[1], range(20))["0"]):
        vectors = Rotation.from_matrix(poses[:, :3, :3].swapaxes(1, 2)).as_rotvec()
        steps = -np.einsum("nji,nj->ni", poses[:, :3, :3], poses[:, :3, 3])
        rows = zip(names.tolist(), vectors.tolist(), steps.tolist(), strict=True)
        lists.append({"shots": {name: {"rotation": v, "translation": t} for name, v, t in rows}})
    (tmp_path / "gt.json").write_text(json.dumps(lists[:1]))
    (tmp_path / "est.json").write_text(json.dumps([lists[1], lists[1], {"shots": {}}]))
    (result,) = score("opensfm", tmp_path / "gt.json", tmp_path / "est.json")
    assert [model["name"] for model in result["models"]] == ["0", "1"]
    (single,) = score("opensfm", tmp_path / "gt.json", tmp_path / "est.json", "--model", "1")
    assert (single["PAS"], single["models"]) == (result["PAS"], [])
    markdown = run("opensfm", tmp_path / "gt.json", tmp_path / "est.json", "--markdown", "-")[1]
    assert "| est.json   | 1       | 20       |" in markdown.replace("\\", "")


def test_compare_takes_folders_of_models(run, example, tmp_path):
    """As the estimate of a system."""
    write_poses["colmap"](tmp_path / "gt", *example[0])
    for system, parts in (("whole", [range(37)]), ("split", [range(20), range(20, 37)])):
        for number, rows in enumerate(parts):
            folder = tmp_path / f"{system}/sparse/{number}"
            write_poses["colmap"](folder, example[1].keys[rows], example[1].poses[rows])
    patterns = f"{tmp_path}/gt", f"{tmp_path}/{{system}}/sparse"
    code, out, err = run("compare", "colmap", *patterns, "--json", "--jobs", "1")
    assert code == 0, err
    scores = {entry["system"]: entry["PAS"] for entry in json.loads(out)["runs"]}
    assert scores["whole"] > scores["split"] + 0.2


def test_names_that_are_matched_by_their_ending(example):
    """A note says so, once; no warning escapes."""
    moved = example[1]._replace(keys=np.array([f"images/{name}" for name in example[1].keys]))
    evaluation = evaluate(example[0], parts_of(moved, range(20), range(20, 37)), metrics=METRICS)
    assert sum("matched by the end of their path" in str(note) for note in evaluation.notes) == 1
    assert evaluation.models[0].images == 20
