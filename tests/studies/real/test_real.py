"""Repeated runs of user-supplied files: metrics whose answers are known, from files to a figure."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from experiments.scenes import make_scene
from studies.real.__main__ import main
from studies.real.answers import agreement, pairs, summarise
from studies.real.figure import draw
from studies.real.scores import ALL_POSES, EQUAL_TIMES

from ..conftest import undescribed

FILE = """
format: tum
reference: "{sequence}/gt.txt"
estimate: "{sequence}/{system}/{run}.txt"
"""


@pytest.fixture(scope="module")
def runs():
    """Two systems on two sequences, ten runs each: three metrics.

    In the TAS the systems differ by 4 standard deviations; the RAS is a monotone function of it;
    the ATE is chance.
    """
    rng = np.random.default_rng(0)
    rows = []
    for sequence in ("desk", "room"):
        for system, mean in (("a", 0.4), ("b", 0.8)):
            for run in range(10):
                tas, ate = rng.normal(mean, 0.1), rng.normal(5)
                keys = {"sequence": sequence, "system": system, "run": str(run), "t_offset": 0.0}
                values = {"TAS": tas, "RAS": np.exp(tas), "ATE": ate}
                rows.append({**keys, "poses": ALL_POSES, **values})
    return pd.DataFrame(rows)


def test_a_metric_that_differs_between_the_systems_orders_them(runs):
    table = summarise(runs).set_index("metric")
    assert set(table.index[:2]) == {"TAS", "RAS"}
    assert table.loc["TAS", "order"] > 99
    assert table.loc["TAS", "runs"] == 6
    assert table.loc["TAS", "significant"] == 100
    assert table.loc["ATE", "runs"] > 20


def test_metrics_that_order_the_runs_alike_agree(runs):
    found = agreement(pairs(runs)).set_index(["metric", "other"])["order"]
    assert found["TAS", "RAS"] == found["TAS", "TAS"]
    assert found["ATE", "TAS"] == pytest.approx(50, abs=25)


@pytest.fixture
def file(tmp_path):
    """Files of two systems with three runs each on a sequence."""
    for system, sigma in (("a", 0.05), ("b", 0.3)):
        for run in range(3):
            scene = make_scene(
                np.random.default_rng(1),
                geometry="car",
                n_cameras=60,
                n_outliers=0,
                sigma_t=0,
                sigma_r_deg=0,
            )
            rng = np.random.default_rng([run, int(100 * sigma)])
            turns = Rotation.from_rotvec(rng.normal(scale=sigma / 10, size=(60, 3)))
            noise = rng.normal(scale=sigma, size=(60, 3))
            (tmp_path / "car" / system).mkdir(parents=True, exist_ok=True)
            write(tmp_path / "car/gt.txt", scene.gt_rotations, scene.gt_positions)
            moved = turns.as_matrix() @ scene.gt_rotations, scene.gt_positions + noise
            write(tmp_path / f"car/{system}/{run}.txt", *moved)
    path = tmp_path / "mine.yaml"
    path.write_text(FILE)
    return path


def score(path, output, *options):
    return main(["--benchmark", str(path), "--sequence", "car", *options, "--output", str(output)])


def write(path, rotations, positions):
    quaternions = Rotation.from_matrix(rotations).as_quat()
    np.savetxt(path, np.column_stack([np.arange(len(positions)) / 10, positions, quaternions]))


def test_from_files_to_a_figure(file, tmp_path):
    (tmp_path / "car/b/3.txt").write_text("no trajectory\n")  # is left out
    own = tmp_path / "car.csv"
    assert score(file, own) == 0
    table = pd.read_csv(own)
    assert table["poses"].value_counts().to_dict() == {ALL_POSES: 6, EQUAL_TIMES: 6}
    every, once_a_second = (table[table["poses"] == name] for name in (ALL_POSES, EQUAL_TIMES))
    assert (every["TAS"].to_numpy() != once_a_second["TAS"].to_numpy()).any()
    answers = [str(tmp_path / name) for name in ("1.csv", "2.csv", "3.csv")]
    assert main([str(own), "--output", *answers]) == 0
    tables = [pd.read_csv(path) for path in answers]
    for function, found in zip((summarise, pairs, agreement), tables, strict=True):
        assert undescribed(function, found) == []
    assert isinstance(draw(*tables), Figure)


def test_the_offset_of_a_clock_is_removed(file, tmp_path):
    before, after = tmp_path / "before.csv", tmp_path / "after.csv"
    assert score(file, before) == 0
    for path in (tmp_path / "car/a").iterdir():
        rows = np.loadtxt(path)
        rows[:, 0] += 0.05
        np.savetxt(path, rows)
    assert score(file, after) == 0
    late, plain = (pd.read_csv(path).query("system == 'a'") for path in (after, before))
    assert (late["t_offset"] - plain["t_offset"]).to_numpy() == pytest.approx(-0.05, abs=0.011)
    assert late["TAS"].to_numpy() == pytest.approx(plain["TAS"].to_numpy(), abs=0.02)


def test_further_metrics_by_name(file, tmp_path, capsys):
    own = tmp_path / "car.csv"
    assert score(file, own, "--more", "rpe@5f,recall@5cm,5deg:hloc,TAS") == 0
    table = pd.read_csv(own)
    assert {"rpe@5f", "recall@5cm,5deg:hloc", "TAS"} <= set(table)
    assert table.columns.is_unique
    assert score(file, own, "--more", "nonsense") == 2
    assert "unknown metric 'nonsense'" in capsys.readouterr().err
