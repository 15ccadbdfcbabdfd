"""Time is the measure: of the command, of ``compare`` and of `evaluate`."""

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from alignscores import closest_pair_quartile, evaluate
from alignscores.trajectories.files import Trajectory, read_tum

N, RATE = 600, 10
ENTRIES = "TAS", "RAS", "PAS", "half_distance", "lost", "unit"


def winding_path(n=N):
    times = np.arange(n) / RATE
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, 3] = np.transpose([10 * np.cos(times / 7), 8 * np.sin(times / 5), np.sin(times)])
    turns = np.transpose([0.3 * np.sin(times), 0.2 * np.cos(times / 3), times / 7])
    poses[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return Trajectory(times, poses)


TRUTH = winding_path()


def of_rows(trajectory, rows):
    return Trajectory(trajectory.keys[rows], trajectory.poses[rows])


def keyframes(seed, n, longest):
    """Rows at irregular steps of 2 to so many frames."""
    rows = np.cumsum(np.random.default_rng(seed).integers(2, longest + 1, n)) - 2
    return rows[rows < n]


def noisy(truth, seed):
    """Noise and drift on every pose."""
    rng, shape = np.random.default_rng(seed), (len(truth.keys), 3)
    poses = truth.poses.copy()
    poses[:, :3, 3] += rng.normal(scale=0.05, size=shape)
    poses[:, :3, 3] += np.cumsum(rng.normal(scale=0.003, size=shape), axis=0)
    turns = Rotation.from_rotvec(rng.normal(scale=0.02, size=shape))
    poses[:, :3, :3] = turns.as_matrix() @ poses[:, :3, :3]
    return Trajectory(truth.keys, poses)


def write_tum(path, trajectory):
    path.parent.mkdir(parents=True, exist_ok=True)
    lost = np.isnan(trajectory.poses[:, 0, 0])
    rotations = np.where(lost[:, None, None], np.eye(3), trajectory.poses[:, :3, :3])
    quaternions = np.where(lost[:, None], np.nan, Rotation.from_matrix(rotations).as_quat())
    rows = np.column_stack([trajectory.keys, trajectory.poses[:, :3, 3], quaternions])
    np.savetxt(path, rows, fmt="%.12f")


def by_command(score, tmp_path, estimates, options):
    files = [tmp_path / "s" / name / "0.txt" for name in estimates]
    results = score("tum", tmp_path / "s/gt.txt", *files, *options)
    return {Path(result["file"]).parent.name: result for result in results}


def by_compare(compare, tmp_path, estimates, options):
    patterns = tmp_path / "{sequence}/gt.txt", tmp_path / "{sequence}/{system}/{run}.txt"
    results = compare("tum", *patterns, *options)["results"]
    return {result["system"]: result for result in results}


def by_evaluate(tmp_path, estimates, options):
    names = [option.removeprefix("--") for option in options[::2]]
    settings = dict(zip(names, options[1::2], strict=True))
    truth = read_tum(tmp_path / "s/gt.txt")
    return {
        name: evaluate(truth, estimate, **settings).to_dict()
        for name, estimate in estimates.items()
    }


@pytest.fixture(params=["command", "compare", "evaluate"])
def scored(request, score, compare, tmp_path):
    """({name: estimate}, *options, truth=) -> {name: entries of its JSON output}."""
    doors = {
        "command": partial(by_command, score),
        "compare": partial(by_compare, compare),
        "evaluate": by_evaluate,
    }

    def scored(estimates, *options, truth=TRUTH):
        write_tum(tmp_path / "s/gt.txt", truth)
        for name, estimate in estimates.items():
            write_tum(tmp_path / "s" / name / "0.txt", estimate)
        found = doors[request.param](tmp_path, estimates, options)
        return {name: {key: result[key] for key in ENTRIES} for name, result in found.items()}

    scored.door = request.param
    return scored


def test_a_perfect_estimate_is_perfect_at_any_rate(scored):
    rows = {f"every {step}": slice(step // 2, None, step) for step in (1, 3, 10, 50)}
    rows["random"] = np.flatnonzero(np.random.default_rng(0).random(N) < 0.3)
    rows["keyframes"] = keyframes(0, N, longest=27)
    found = scored({name: of_rows(TRUTH, kept) for name, kept in rows.items()})
    assert set(found) == set(rows)
    for result in found.values():
        assert result["PAS"] == 1
        assert result["half_distance"] < 1e-6  # m; the files are rounded
        assert result["lost"] == 0


@pytest.mark.parametrize("step", [1, 5])
def test_losing_a_tenth_of_the_time_costs_a_tenth(scored, step):
    rows, n_lost = np.arange(0, N, step), N // 10
    first = {"start": 0, "middle": 4 * n_lost, "end": N - n_lost}
    estimates = {
        name: of_rows(TRUTH, rows[(rows < lost) | (rows >= lost + n_lost)])
        for name, lost in first.items()
    }
    estimates["random"] = of_rows(TRUTH, rows[np.random.default_rng(1).random(len(rows)) < 0.9])
    found = scored(estimates)
    for name in first:
        assert found[name]["lost"] == pytest.approx(0.1, abs=1.01 * step / N)
        for key in ("TAS", "RAS", "PAS"):
            assert found[name][key] == pytest.approx(1 - found[name]["lost"], abs=1e-4)
    assert (found["random"]["lost"], found["random"]["PAS"]) == (0, 1)


def test_poses_are_compared_with_the_reference_at_their_own_time(scored):
    times = TRUTH.keys[:-1] + 0.5 / RATE
    poses = np.tile(np.eye(4), (N - 1, 1, 1))
    slerp = Slerp(TRUTH.keys, Rotation.from_matrix(TRUTH.poses[:, :3, :3]))
    poses[:, :3, :3] = slerp(times).as_matrix()
    poses[:, :3, 3] = (TRUTH.poses[1:, :3, 3] + TRUTH.poses[:-1, :3, 3]) / 2
    between = {"between": Trajectory(times, poses)}
    found = scored(between)["between"]
    assert (found["PAS"], found["lost"]) == (1, 0)
    nearest = scored(between, "--sync", "nearest", "--t_max_diff", 0.06)["between"]
    assert nearest["lost"] == 0
    assert nearest["TAS"] < 0.8


def test_d_is_that_of_the_frames_that_were_due(scored):
    """Of each frame of the densest estimate, whatever others have or have lost."""
    rows = {"all": slice(None), "fifth": slice(None, None, 5), "half": slice(0, N // 2)}
    estimates = {name: of_rows(TRUTH, kept) for name, kept in rows.items()}
    estimates["keyframes"] = of_rows(TRUTH, keyframes(1, N, longest=27))
    units = {name: result["unit"] for name, result in scored(estimates).items()}
    of_all = closest_pair_quartile(TRUTH.poses[:, :3, 3])
    if scored.door == "evaluate":  # each is the only one
        assert units["all"] == units["half"] == pytest.approx(of_all)
        of_fifth = closest_pair_quartile(TRUTH.poses[::5, :3, 3])
        assert units["fifth"] == pytest.approx(of_fifth)
    else:
        assert set(units) == set(rows) | {"keyframes"}
        assert len(set(units.values())) == 1
        assert units["all"] == pytest.approx(of_all)


def test_what_n_and_lost_mean_is_said_in_one_line(run, tmp_path):
    write_tum(tmp_path / "gt.txt", TRUTH)
    write_tum(tmp_path / "est.txt", of_rows(TRUTH, slice(0, 300, 5)))
    _, out, _ = run("tum", tmp_path / "gt.txt", tmp_path / "est.txt")
    (line,) = [line for line in out.splitlines() if line.startswith("n: ")]
    assert line.startswith("n: frames that were due, the same for all, and d is theirs; ")
    assert line.endswith("; lost: share of the time without a pose")


LONG, SEEDS, RUNS = 1200, 3, 3


@pytest.fixture(scope="module")
def thinned(tmp_path_factory):
    """Folder of a benchmark, each system has the same runs: all frames, every fourth, keyframes."""
    folder, truth = tmp_path_factory.mktemp("thinned"), winding_path(LONG)
    for seed in range(SEEDS):
        write_tum(folder / f"{seed}/gt.txt", truth)
        for number in range(RUNS):
            estimate = noisy(truth, [seed, number])
            for name, rows in {
                "all": slice(None),
                "fourth": slice(None, None, 4),
                "keyframes": keyframes([seed, number, 1], LONG, longest=9),
            }.items():
                write_tum(folder / f"{seed}/{name}/{number}.txt", of_rows(estimate, rows))
    return folder


def test_all_frames_and_keyframes_are_not_told_apart(thinned, compare, score):
    patterns = thinned / "{sequence}/gt.txt", thinned / "{sequence}/{system}/{run}.txt"
    found = compare("tum", *patterns)
    means = {entry["system"]: entry for entry in found["systems"] if entry["sequence"] is None}
    for name in ("fourth", "keyframes"):
        assert means[name]["TAS"] == pytest.approx(means["all"]["TAS"], abs=0.02)
        half = means["all"]["half_distance"]
        assert means[name]["half_distance"] == pytest.approx(half, rel=0.05)
        assert means[name]["lost"] == 0
    alarms = {
        (entry["sequence"], entry["metric"])
        for entry in found["comparisons"]
        if entry["distinguishable"]
    }
    columns = {(entry["sequence"], entry["metric"]) for entry in found["comparisons"]}
    assert len(columns) == 5 * (SEEDS + 1)
    assert len(alarms) <= 0.05 * len(columns)

    # The command and `evaluate` have the same numbers.
    of_run = {
        entry["system"]: entry
        for entry in found["results"]
        if (entry["sequence"], entry["run"]) == ("0", "0")
    }
    files = [thinned / f"0/{name}/0.txt" for name in of_run]
    for result in score("tum", thinned / "0/gt.txt", *files):
        expected = of_run[Path(result["file"]).parent.name]
        for key in ENTRIES:
            assert result[key] == pytest.approx(expected[key], rel=1e-9)
    unit = of_run["all"]["unit"]
    for name, expected in of_run.items():
        estimate = read_tum(thinned / f"0/{name}/0.txt")
        result = evaluate(read_tum(thinned / "0/gt.txt"), estimate, unit=unit)
        assert result.tas == pytest.approx(expected["TAS"], abs=0.02)
        assert result.half_distance == pytest.approx(expected["half_distance"], rel=0.05)


EUROC = {  # some runs
    "MH_05": ["vislam_ba/0", "vislam_rp/0", "vio_stereo/0"],
    "V2_02": ["vislam_ba/0", "vislam_ba/1", "vislam_rp/0", "vio_mono/0"],
}


def uncovered(reference, estimate):
    """Return the share of the time in gaps between stamps, less half a step at their ends."""
    step = np.median(np.diff(estimate))
    inside = estimate[(estimate >= reference[0]) & (estimate <= reference[-1])]
    gaps = np.diff([reference[0], *inside, reference[-1]])
    ends = np.full(len(gaps), step)
    ends[[0, -1]] = step / 2
    long = gaps > max(10 * step, 1.0)
    return np.sum((gaps - ends)[long]) / (reference[-1] - reference[0])


def test_real_runs_have_lost_the_time_that_they_do_not_cover(real, compare, tmp_path):
    if not (real / "euroc").is_dir():
        pytest.skip(f"no EuRoC runs at {real / 'euroc'}")
    for sequence, runs in EUROC.items():
        for name in ("groundtruth", *runs):
            file = tmp_path / sequence / f"{name}.txt"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.symlink_to(real / "euroc" / sequence / f"{name}.txt")
    found = compare("tum", "{sequence}/groundtruth.txt", "{sequence}/{system}/{run}.txt")
    scored = [entry for entry in found["results"] if entry["status"] == "scored"]
    assert len(scored) == sum(map(len, EUROC.values()))
    for entry in scored:
        reference, estimate = (
            np.loadtxt(tmp_path / entry["sequence"] / name, usecols=0)
            for name in ("groundtruth.txt", f"{entry['system']}/{entry['run']}.txt")
        )
        assert entry["lost"] == pytest.approx(uncovered(reference, estimate), abs=0.02)
        assert entry["half_distance"] is not None
        assert np.isfinite(entry["half_distance"])
    assert all(entry["lost"] < 0.5 for entry in scored)


@pytest.mark.parametrize("rows", [[0, 100, 300, 301, 302, N - 1], range(200, 320)])
@pytest.mark.parametrize("options", [(), ("--missing", "ignore"), ("--max_gap", 0.25)])
def test_a_pose_of_nan_is_one_that_is_left_out(scored, rows, options):
    truth = noisy(TRUTH, 0)
    poses = truth.poses.copy()
    poses[list(rows), :3] = np.nan
    left_out = of_rows(truth, np.setdiff1d(np.arange(N), rows))
    estimates = {"nan": Trajectory(truth.keys, poses), "left out": left_out}
    found = scored(estimates, *options)
    assert found["nan"] == found["left out"]


def test_an_estimate_of_nan_alone_scores_zero(scored):
    poses = np.full_like(TRUTH.poses, np.nan)
    assert scored({"nan": Trajectory(TRUTH.keys, poses)})["nan"]["PAS"] == 0
