"""Trials evaluate the library's metrics, with options; metrics of one trial share its errors."""

import re
from math import ceil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from alignscores import metrics as library
from alignscores import pas, ras, ras_profile, tas, tas_profile
from alignscores.paper import literal_frames
from alignscores.registration import pcr99
from baselines import ate, dre, dte, maa, rotation_statistics
from baselines.averages import rotation_l1_means
from baselines.rotation import aligned_angles
from experiments import metrics
from experiments.command import ConfigError
from experiments.config import to_overrides
from experiments.grid import KEY_COLUMNS, Cell, cells
from experiments.metrics import METRICS, evaluate, evaluate_scenes, metric, with_options
from experiments.sweep import draw_scene, trial_seeds

SEED = np.random.SeedSequence(7)


@pytest.fixture
def scene(small):
    return draw_scene(small(), Cell(45, 5, 0.05, 4.0), np.random.SeedSequence(1))


def value(scene, metric):
    return evaluate(scene, [metric], SEED)[metric]


def closest(scene):
    distances = cdist(scene.gt_positions, scene.gt_positions)
    np.fill_diagonal(distances, np.inf)
    return np.sort(distances.min(axis=1))


def staircase(errors, largest, count):
    """Count camera by camera and threshold by threshold."""
    below = sum(e < largest * k / count for e in errors for k in range(1, count + 1))
    return below / (count * len(errors))


@pytest.mark.parametrize("threshold", [0.25, 1.0, 4.0])
@pytest.mark.parametrize("count", [5, 100])
def test_scores_are_counts_of_the_same_errors(scene, threshold, count):
    plain = tas(scene.gt_positions, scene.est_positions, rng=SEED)
    score = value(scene, f"TAS(max_threshold={threshold}, n_thresholds={count})")
    assert score == pytest.approx(staircase(plain.errors, threshold * plain.unit, count), abs=1e-12)
    rotations = ras(scene.gt_rotations, scene.est_rotations)
    score = value(scene, f"RAS(max_threshold_deg={10 * threshold}, n_thresholds={count})")
    assert score == pytest.approx(staircase(rotations.errors, 10 * threshold, count), abs=1e-12)


def test_scenes_in_one_batch_have_the_values_of_single_scenes(small):
    """Scenes of several sizes, in no order, with missing cameras and with coinciding ones."""
    scenes = []
    for seed, n, lost in ((0, 30, 0), (1, 12, 0), (2, 30, 5), (3, 25, 0), (4, 30, 0), (5, 12, 3)):
        cell = Cell(n, lost, 0.0 if seed == 4 else 0.05, 4.0)
        sweep = small("outliers=missing" if lost else "outliers=uniform")
        scenes.append(draw_scene(sweep, cell, np.random.SeedSequence(seed)))
    scenes[3].est_positions[:20] = scenes[3].est_positions[0]  # without an extent, for the DTE
    metrics = [*METRICS, "TAS(registration=refined)", "PAS(weight=0.3)"]
    seeds = [np.random.SeedSequence(0, spawn_key=(scene,)) for scene in range(len(scenes))]
    together = evaluate_scenes(scenes, seeds, metrics)
    for index, scene in enumerate(scenes):
        single = evaluate(scene, metrics, seeds[index])
        assert {metric: values[index] for metric, values in together.items()} == single


def test_options_of_the_sweep_hold_for_columns_without_options(small, scene):
    sweep = small(
        "tas.max_threshold=2", "ras.max_threshold_deg=5", "pas.weight=0.3", "d.interpolated=true"
    )
    values = evaluate(scene, ["TAS", "TAS(quantile=0.5)", "RAS", "PAS", "d"], SEED, sweep)
    assert values["TAS"] == value(scene, "TAS(max_threshold=2)")
    assert values["TAS(quantile=0.5)"] == value(scene, "TAS(quantile=0.5, max_threshold=2)")
    assert values["RAS"] == value(scene, "RAS(max_threshold_deg=5)")
    assert values["PAS"] == 0.3 * values["TAS"] + 0.7 * values["RAS"]
    assert values["d"] == value(scene, "d(interpolated=true)")


def test_metrics_are_those_of_the_library(scene):
    poses = scene.gt_poses, scene.est_poses
    positions = scene.gt_positions, scene.est_positions
    rotations = scene.gt_rotations, scene.est_rotations
    scores = pas(*poses, rng=SEED)
    expected = {
        "TAS": scores.tas.score,
        "RAS": scores.ras.score,
        "PAS": scores.score,
        "PAS(weight=0.3)": pas(*poses, rng=SEED, weight=0.3).score,
        "PAS(registration=refined)": pas(*poses, rng=SEED, registration="refined").score,
        "TAS(registration=refined, max_threshold=2)": tas(
            *positions, rng=SEED, registration="refined", max_threshold=2
        ).score,
        "TAS(registration=literal_frames)": tas(
            *positions, rng=SEED, registration=literal_frames
        ).score,
        "ATE": ate(*positions),
        "DTE": dte(*poses),
        "DRE": dre(*rotations),
        "mAA": maa(*poses),
        "mAA(max_threshold_deg=5, fold_sign=True)": maa(
            *poses, max_threshold_deg=5, fold_sign=True
        ),
        **rotation_statistics(*rotations),
    }
    assert evaluate(scene, list(expected), SEED) == expected


def test_columns_have_the_names_that_were_asked_for(small, run):
    names = ["HalfDistance", "half_distance", "HalfAngle", "tas"]
    table = run(small("n_outliers=[2]", "trials=2", f"metrics=[{','.join(map(repr, names))}]"))
    assert list(table.columns) == [*KEY_COLUMNS, *names]
    assert (table["HalfDistance"] == table["half_distance"]).all()
    assert with_options("TAS", {"quantile": 0.5, "order": 0.3}) == "TAS(quantile=0.5, order=0.3)"


@pytest.mark.parametrize("score", [0.5, 0.25])
def test_half_score_units_are_those_of_the_profiles(scene, score):
    profile = tas_profile(scene.gt_positions, scene.est_positions, rng=SEED)
    distance = value(scene, f"half_distance(score={score})")
    assert distance == pytest.approx(profile.unit_at(score), rel=0.01)
    rotations = ras_profile(scene.gt_rotations, scene.est_rotations)
    assert value(scene, f"half_angle(score={score})") == rotations.unit_at(score)


@pytest.mark.parametrize("quantile", [0.02, 0.25, 0.6, 0.75, 1])
def test_the_quantile_that_is_d(scene, quantile):
    unit = closest(scene)[ceil(round(quantile * 45, 6)) - 1]
    errors = tas(scene.gt_positions, scene.est_positions, rng=SEED).errors
    score = value(scene, f"TAS(quantile={quantile})")
    assert score == pytest.approx(staircase(errors, unit, 100), abs=1e-12)


def test_d_between_two_distances(scene):
    interpolated = float(np.quantile(closest(scene), 0.75))
    assert value(scene, "d") == closest(scene)[ceil(0.75 * 45) - 1]
    assert value(scene, "d(interpolated=true)") == pytest.approx(interpolated)
    expected = tas(scene.gt_positions, scene.est_positions, rng=SEED, unit=interpolated).score
    assert value(scene, "TAS(interpolated=true)") == pytest.approx(expected)
    both = (expected + value(scene, "RAS")) / 2
    assert value(scene, "PAS(interpolated=true)") == pytest.approx(both)


def test_the_ras_of_the_l1_average(scene):
    gt, est = scene.gt_rotations, scene.est_rotations
    (mean,) = rotation_l1_means((gt @ est.transpose(0, 2, 1))[None])
    errors = aligned_angles(gt, est, mean)
    assert value(scene, "RAS(averaging=l1)") == pytest.approx(staircase(errors, 10, 100))


def test_the_papers_values_written_out_change_no_bit(small):
    written = [
        "TAS(max_threshold=1, quantile=0.75, n_thresholds=100)",
        "TAS(n_hypotheses=1000, prescreen=0.1, order=0.1, registration=pcr99)",
    ]
    for n in (8, 15, 25, 44, 45, 46, 95, 115, 205):  # m rounds halves up
        scene = draw_scene(small(), Cell(n, 0, 0.02, 4.0), np.random.SeedSequence(n))
        values = evaluate(scene, ["TAS", *written], SEED)
        assert len(set(values.values())) == 1, n


@pytest.mark.parametrize(
    ("options", "m", "prescreen"),
    [
        ("order=0.5", 23, 0.1),
        ("order=0.01", 4, 0.1),
        ("prescreen=0.03", 5, 0.03),
        ("prescreen=inf", 5, np.inf),
    ],
)
def test_order_and_prescreen_reach_the_registration(scene, options, m, prescreen):
    expected = tas(
        scene.gt_positions,
        scene.est_positions,
        rng=SEED,
        registration=lambda *clouds, rank, **settings: pcr99(
            *clouds, rank=m, prescreen=prescreen, **settings
        ),
    )
    assert value(scene, f"TAS({options})") == expected.score


@pytest.mark.parametrize(
    ("column", "problem"),
    [
        ("APE", "unknown metric 'APE'; close to it are ATE"),
        ("PAS(order=0.2)", "has no option 'order'; the options are weight, registration, "),
        ("auc@30:vggt(k=5)", "has no option 'k'; the options are none"),
        ("TAS(order=0.2", "has no closing bracket"),
        ("TAS(max_threshold=inf)", "max_threshold should be a finite number, not 'inf'"),
        ("TAS(n_thresholds=2.5)", "n_thresholds should be a valid integer, "),
        ("mAA(fold_sign=maybe)", "fold_sign should be a valid boolean, "),
        ("TAS(registration=umeyama)", "registration should be 'pcr99', 'refined' or 'literal_"),
        ("TAS(registration=refined, order=0.2)", "prescreen and order can be set only for pcr99"),
    ],
)
def test_impossible_options_are_refused_in_one_line(column, problem):
    with pytest.raises(ConfigError) as caught:
        metric(column)
    assert problem in str(caught.value)
    assert repr(column) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_other_projects_metrics_are_metrics_by_their_names(small, run):
    """With commas and colons, in a sweep; NaN where one has no value."""
    names = ["auc@30:vggt", "recall@1m,9deg:hloc-sim3", "ate:rmse", "are:rmse"]
    metrics = to_overrides({"metrics": [*names, "kitti"]})
    sweep = small("n_outliers=[2]", "sigma_t=[0.02]", "sigma_r_deg=[3]", "trials=2", *metrics)
    table = run(sweep)
    assert list(table.columns) == [*KEY_COLUMNS, *names, "kitti"]
    assert table["kitti"].isna().all()  # no path of 100 m
    (cell,) = cells(sweep)
    for trial, row in table.iterrows():
        cameras, _ = trial_seeds(sweep, cell, trial)
        scene = draw_scene(sweep, cell, cameras)
        for name in names:
            assert row[name] == library.metric(name)(scene.gt_poses, scene.est_poses)


def test_the_metric_on_the_page_is_one_function_and_one_entry(scene, monkeypatch):
    page = Path(__file__).parents[3] / "docs" / "develop" / "extend.md"
    function, entry = re.findall(r"^```py\n(.*?)^```$", page.read_text(), re.M | re.S)[:2]
    names = dict(vars(metrics))
    exec(function, names)
    monkeypatch.setattr(metrics, "METRICS", {**METRICS, "Largest": eval(entry, names)})
    metrics.metric.cache_clear()
    errors = tas(scene.gt_positions, scene.est_positions, rng=SEED).errors
    values = evaluate(scene, ["TAS", "Largest", "Largest(quantile=0.5)"], SEED)
    assert values["Largest"] == errors.max()
    assert values["Largest(quantile=0.5)"] == np.median(errors)
    with pytest.raises(ConfigError, match="quantile should be less than or equal to 1"):
        metric("Largest(quantile=2)")
    metrics.metric.cache_clear()
