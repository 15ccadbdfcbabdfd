"""Metrics with options are paired: one alignment, one set of errors, scored many times."""

from collections.abc import Callable
from math import ceil

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.distance import cdist

import experiments.metrics
from alignscores import pas, ras, ras_profile, tas, tas_profile
from alignscores.metrics import named
from alignscores.protocols import Family, protocol
from alignscores.registration import pcr99
from baselines import ate, dre, dte, literal_frames, maa, rotation_statistics
from baselines.averages import rotation_l1_mean
from baselines.pairwise import maa_by_counts
from baselines.rotation import aligned_angles
from experiments.command import ConfigError
from experiments.config import Sweep, to_overrides
from experiments.grid import KEY_COLUMNS, Cell, cells
from experiments.metrics import (
    METRICS,
    Column,
    Evaluation,
    Options,
    Scenes,
    TrialMetric,
    evaluate,
)
from experiments.scenes import Scene
from experiments.sweep import draw_scene, trial_seeds
from studies.statistics import power

SEED = np.random.SeedSequence(7)
THRESHOLDS = (0.25, 0.5, 1.0, 2.0, 4.0)


@pytest.fixture
def scene(small: Callable[..., Sweep]) -> Scene:
    return draw_scene(small(), Cell(45, 5, 0.05, 4.0), np.random.SeedSequence(1))


def closest(scene: Scene) -> np.ndarray:
    distances = cdist(scene.gt_positions, scene.gt_positions)
    np.fill_diagonal(distances, np.inf)
    return np.sort(distances.min(axis=1))


def staircase(errors: np.ndarray, largest: float, count: int) -> float:
    """Count camera by camera and threshold by threshold."""
    below = sum(e < largest * k / count for e in errors for k in range(1, count + 1))
    return below / (count * len(errors))


@pytest.mark.parametrize("threshold", THRESHOLDS)
@pytest.mark.parametrize("count", [5, 100])
def test_scores_are_counts_of_the_same_errors(scene: Scene, threshold: float, count: int) -> None:
    plain = tas(scene.gt_positions, scene.est_positions, rng=SEED)
    metric = f"TAS(max_threshold={threshold}, n_thresholds={count})"
    value = evaluate(scene, [metric], SEED)[metric]
    brute_force = staircase(plain.errors, threshold * plain.unit, count)
    assert value == pytest.approx(brute_force, abs=1e-12)
    rotations = ras(scene.gt_rotations, scene.est_rotations)
    metric = f"RAS(max_threshold_deg={10 * threshold}, n_thresholds={count})"
    value = evaluate(scene, [metric], SEED)[metric]
    assert value == pytest.approx(staircase(rotations.errors, 10 * threshold, count), abs=1e-12)


def test_infinitely_many_thresholds_are_the_limit_of_many(scene: Scene) -> None:
    names = ["TAS(n_thresholds=inf)", "TAS(n_thresholds=100000)", "RAS(n_thresholds=inf)"]
    values = evaluate(scene, [*names, "RAS(n_thresholds=100000)"], SEED)
    exact, many, exact_ras, many_ras = values.values()
    assert 0 < many - exact < 1e-5
    assert 0 < many_ras - exact_ras < 1e-5
    errors = tas(scene.gt_positions, scene.est_positions, rng=SEED)
    area = np.maximum(0, 1 - errors.errors / errors.unit).mean()
    assert exact == pytest.approx(area, abs=1e-15)


def test_all_thresholds_share_one_alignment(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    monkeypatch.setattr(
        experiments.metrics,
        "tas",
        lambda *args, **kwargs: calls.append(kwargs) or tas(*args, **kwargs),
    )
    metrics = [f"TAS(max_threshold={t})" for t in THRESHOLDS]
    metrics += ["TAS", "TAS(quantile=0.5)", "TAS(n_thresholds=inf)", "PAS", "PAS(weight=0.25)"]
    evaluation = Evaluation(scene, SEED)
    together = [evaluation.value(Column.parse(metric)) for metric in metrics]
    assert len(calls) == 1
    assert together == [evaluate(scene, [metric], SEED)[metric] for metric in metrics]
    calls.clear()
    for metric in ("TAS(n_hypotheses=30)", "TAS(n_hypotheses=30, max_threshold=2)", "TAS(seed=1)"):
        evaluation.value(Column.parse(metric))
    assert len(calls) == 2


def test_scenes_side_by_side_have_the_bits_of_one_by_one(small: Callable[..., Sweep]) -> None:
    """Of several sizes, in no order, with lost cameras and with coinciding ones."""
    scenes = []
    for seed, n, lost in ((0, 30, 0), (1, 12, 0), (2, 30, 5), (3, 25, 0), (4, 30, 0), (5, 12, 3)):
        cell = Cell(n, lost, 0.0 if seed == 4 else 0.05, 4.0)
        sweep = small("outliers=missing" if lost else "outliers=uniform")
        scenes.append(draw_scene(sweep, cell, np.random.SeedSequence(seed)))
    scenes[3].est_positions[:20] = scenes[3].est_positions[0]  # without an extent, for the DTE
    beside = Scenes(scenes)
    for place, scene in enumerate(scenes):
        kept, all_rotations = scene.estimated, (scene.gt_rotations, scene.est_rotations)
        rotations = kept.gt_rotations, kept.est_rotations
        assert beside.dte[place] == dte(kept.gt_poses, kept.est_poses)
        assert beside.dre[place] == dre(*rotations)
        for name, value in rotation_statistics(*rotations).items():
            assert beside.rotation_statistics[name][place] == value
        np.testing.assert_array_equal(beside.rotation_errors[place], ras(*all_rotations).errors)


def test_counts_of_pairs_share_their_angles(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    monkeypatch.setattr(
        experiments.metrics,
        "maa_by_counts",
        lambda *args: calls.append(args) or maa_by_counts(*args),
    )
    options = ["", "(pooled=true)", "(max_threshold_deg=90)", "(n_thresholds=10)"]
    metrics = [f"mAA{option}" for option in options]
    together = evaluate(scene, metrics, SEED)
    assert len(calls) == 1
    evaluation = Evaluation(scene, SEED)
    apart = {metric: evaluation.value(Column.parse(metric)) for metric in metrics}
    assert len(calls) == 1 + len(metrics)
    assert together == apart
    assert len(set(apart.values())) == len(metrics)


def test_the_refined_registration_knows_the_threshold(scene: Scene) -> None:
    for threshold in (0.5, 2.0):
        metric = f"TAS(registration=refined, max_threshold={threshold})"
        expected = tas(
            scene.gt_positions,
            scene.est_positions,
            rng=SEED,
            registration="refined",
            max_threshold=threshold,
        )
        assert (
            evaluate(scene, ["TAS(registration=refined)", metric], SEED)[metric] == expected.score
        )


def test_metrics_are_those_of_the_library(scene: Scene) -> None:
    names = [*METRICS, "PAS(weight=0.3)", "PAS(registration=refined, weight=0.3)"]
    values = evaluate(scene, [*names, "mAA(max_threshold_deg=5, fold_sign=True)"], SEED)
    assert np.isfinite(list(values.values())).all()
    poses = scene.gt_poses, scene.est_poses
    scores = pas(*poses, rng=SEED)
    assert [values[name] for name in ("TAS", "RAS", "PAS", "PAS(weight=0.3)")] == [
        scores.tas.score,
        scores.ras.score,
        scores.score,
        pas(*poses, rng=SEED, weight=0.3).score,
    ]
    refined = pas(*poses, rng=SEED, weight=0.3, registration="refined")
    assert values["PAS(registration=refined, weight=0.3)"] == refined.score
    assert values["ATE"] == ate(scene.gt_positions, scene.est_positions)
    assert values["DTE"] == dte(*poses)
    assert values["DRE"] == dre(scene.gt_rotations, scene.est_rotations)
    assert values["mAA"] == maa(*poses)
    folded = maa(*poses, max_threshold_deg=5, fold_sign=True)
    assert values["mAA(max_threshold_deg=5, fold_sign=True)"] == folded != values["mAA"]
    for name, value in rotation_statistics(scene.gt_rotations, scene.est_rotations).items():
        assert values[name] == value


def test_trials_evaluate_what_the_vocabulary_says(scene: Scene) -> None:
    """Each entry, on the cameras at once: options and sharing change no value."""
    values = evaluate(scene, list(METRICS), SEED)
    for name, entry in METRICS.items():
        column = Column.parse(name.upper())
        assert (column.metric.name, column.metric.family) == (name, entry.family)
        tolerance = {"half_distance": 0.01, "ATE": 1e-12}.get(name, 0)
        expected = column.metric(*scene.arrays, rng=SEED)
        assert values[name] == pytest.approx(expected, rel=tolerance, abs=0)


def test_columns_have_the_names_that_were_asked_for(
    small: Callable[..., Sweep], run: Callable[..., pd.DataFrame]
) -> None:
    """Old names are those of the same metric."""
    column = Column.parse("HalfDistance(score=0.25)")
    assert (column.name, column.options) == ("HalfDistance", {"score": "0.25"})
    assert (column.metric.name, column.metric.alias) == ("half_distance", "HalfDistance")
    assert str(column.with_option("seed", 3)) == "HalfDistance(score=0.25, seed=3)"
    names = ["HalfDistance", "half_distance", "HalfAngle", "half:rotation", "tas"]
    table = run(small("n_outliers=[2]", "trials=2", f"metrics=[{','.join(map(repr, names))}]"))
    assert list(table.columns) == [*KEY_COLUMNS, *names]
    assert (table["HalfDistance"] == table["half_distance"]).all()
    assert (table["HalfAngle"] == table["half:rotation"]).all()


@pytest.mark.parametrize("score", [0.5, 0.25])
def test_half_score_units_are_those_of_the_profiles(scene: Scene, score: float) -> None:
    """Whatever units the search starts from."""
    metrics = [f"HalfDistance(score={score})", f"HalfAngle(score={score})"]
    distance, angle = evaluate(scene, metrics, SEED).values()
    profile = tas_profile(scene.gt_positions, scene.est_positions, rng=SEED)
    assert distance == pytest.approx(profile.unit_at(score), rel=0.01)
    assert angle == ras_profile(scene.gt_rotations, scene.est_rotations).unit_at(score)


def test_a_seed_of_the_registration_is_another_in_each_trial(scene: Scene) -> None:
    own = [
        evaluate(scene, ["TAS(seed=0)"], np.random.SeedSequence(0, spawn_key=(trial,)))[
            "TAS(seed=0)"
        ]
        for trial in range(8)
    ]
    assert len(set(own)) > 1


@pytest.mark.parametrize("quantile", [0.02, 0.25, 0.5, 0.6, 0.75, 0.9, 1])
def test_the_quantile_that_is_d(scene: Scene, quantile: float) -> None:
    unit = closest(scene)[ceil(round(quantile * 45, 6)) - 1]
    metric = f"TAS(quantile={quantile}, n_thresholds=inf)"
    errors = tas(scene.gt_positions, scene.est_positions, rng=SEED).errors
    area = np.maximum(0, 1 - errors / unit).mean()
    assert evaluate(scene, [metric], SEED)[metric] == pytest.approx(area, rel=1e-9)


def test_d_between_two_distances(scene: Scene) -> None:
    interpolated = float(np.quantile(closest(scene), 0.75))
    values = evaluate(scene, ["d", "d(interpolated=true)"], SEED)
    assert values["d"] == closest(scene)[ceil(0.75 * 45) - 1]
    assert values["d(interpolated=true)"] == pytest.approx(interpolated)
    own = tas(scene.gt_positions, scene.est_positions, rng=SEED, unit=interpolated)
    found = evaluate(scene, ["TAS(interpolated=true)", "PAS(interpolated=true)", "RAS"], SEED)
    assert found["TAS(interpolated=true)"] == pytest.approx(own.score)
    assert found["PAS(interpolated=true)"] == pytest.approx((own.score + found["RAS"]) / 2)


def test_other_alignments(scene: Scene) -> None:
    name = "TAS(registration=literal_frames)"
    positions = scene.gt_positions, scene.est_positions
    own = tas(*positions, rng=SEED, registration=literal_frames)
    assert evaluate(scene, [name], SEED)[name] == own.score
    # The mean of these angles and their RMS are what the DRE is the mean of.
    rotations = scene.gt_rotations, scene.est_rotations
    between = rotation_l1_mean(rotations[0] @ rotations[1].transpose(0, 2, 1))
    errors = aligned_angles(*rotations, between)
    assert np.mean([errors.mean(), np.sqrt((errors**2).mean())]) == pytest.approx(dre(*rotations))
    name = "RAS(averaging=l1)"
    assert evaluate(scene, [name], SEED)[name] == pytest.approx(staircase(errors, 10, 100))


def test_the_papers_values_written_out_change_no_bit(small: Callable[..., Sweep]) -> None:
    written = [
        "TAS(max_threshold=1, quantile=0.75, n_thresholds=100)",
        "TAS(n_hypotheses=1000, prescreen=0.1, order=0.1, registration=pcr99)",
    ]
    for n in (8, 15, 25, 44, 45, 46, 95, 115, 205):  # m rounds halves up
        scene = draw_scene(small(), Cell(n, 0, 0.02, 4.0), np.random.SeedSequence(n))
        values = evaluate(scene, ["TAS", *written], SEED)
        assert len(set(values.values())) == 1, n


def test_order_and_prescreen_reach_the_registration(scene: Scene) -> None:
    gt, est = scene.gt_positions, scene.est_positions
    for name, order, prescreen in (
        ("TAS(order=0.5)", 23, 0.1),
        ("TAS(order=0.01)", 4, 0.1),
        ("TAS(prescreen=0.03)", 5, 0.03),
        ("TAS(prescreen=inf)", 5, np.inf),
    ):
        expected = tas(
            gt,
            est,
            rng=SEED,
            registration=lambda *clouds, rank, m=order, p=prescreen, **settings: pcr99(
                *clouds, rank=m, prescreen=p, **settings
            ),
        )
        assert evaluate(scene, [name], SEED)[name] == expected.score
    values = evaluate(scene, ["TAS", "TAS(order=0.5)", "TAS(prescreen=0.03)"], SEED)
    assert len(set(values.values())) == 3


def test_seeds_differ_and_repeat(scene: Scene) -> None:
    metrics = [f"TAS(seed={seed})" for seed in range(6)]
    values = evaluate(scene, ["TAS", *metrics, "PAS(seed=3)", "RAS"], SEED)
    assert len(set(values.values())) >= 5
    assert values["PAS(seed=3)"] == 0.5 * values["TAS(seed=3)"] + 0.5 * values["RAS"]
    assert evaluate(scene, metrics[::-1], SEED)["TAS(seed=2)"] == values["TAS(seed=2)"]


@pytest.mark.parametrize(
    ("metric", "problem"),
    [
        ("APE", "unknown metric 'APE'; close to it are ATE, "),
        (
            "PAS(order=0.2)",
            "has no option 'order'; the options are interpolated, registration, seed, weight",
        ),
        ("auc@30", "; close to it are auc@30:vggt, "),
        ("auc@30:vggt(k=5)", "has no option 'k'; the options are none"),
        ("TAS(order=0.2", "has no option 'order'; the options are "),
        ("TAS(max_threshold=-1)", "max_threshold should be greater than 0, not '-1'"),
        ("TAS(max_threshold=inf)", "max_threshold should be a finite number, not 'inf'"),
        ("TAS(max_threshold=much)", "max_threshold should be a valid number, "),
        (
            "TAS(n_thresholds=2.5)",
            "n_thresholds must be a whole number from 1 to 1000000, or inf, not 2.5",
        ),
        ("RAS(n_thresholds=True)", "n_thresholds should be a valid number, "),
        ("mAA(fold_sign=maybe)", "fold_sign should be a valid boolean, "),
        ("TAS(quantile=0)", "quantile should be greater than 0, not '0'"),
        ("TAS(n_hypotheses=0)", "n_hypotheses should be greater than 0, not '0'"),
        ("TAS(prescreen=0)", "prescreen should be greater than 0, not '0'"),
        ("TAS(n_thresholds=1e20)", "n_thresholds must be a whole number from 1 to 1000000, or inf"),
        ("TAS(max_threshold=1e308)", "max_threshold should be at most 1e+100, not '1e308'"),
        ("TAS(order=1.5)", "order should be at most 1, not '1.5'"),
        (
            "TAS(registration=umeyama)",
            "registration should be 'pcr99', 'refined' or 'literal_frames', not 'umeyama'",
        ),
        ("TAS(registration=refined, order=0.2)", "order can be set for pcr99 alone"),
        ("TAS(seed=-1)", "seed should be greater than or equal to 0, not '-1'"),
        ("PAS(weight=1.1)", "weight should be at most 1, not '1.1'"),
    ],
)
def test_impossible_options_are_refused_in_one_line(metric: str, problem: str) -> None:
    with pytest.raises(ConfigError) as caught:
        Column.parse(metric)
    assert problem in str(caught.value)
    assert repr(metric) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_metric_is_one_entry_of_the_registry(
    small: Callable[..., Sweep],
    run: Callable[..., pd.DataFrame],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its name is known to the settings, its column is swept, its direction decides its power."""

    class Scale(Options):
        scale: float = 1.0

    def accuracy(evaluation: Evaluation, options: Scale) -> float:
        errors = ras(evaluation.scene.gt_rotations, evaluation.scene.est_rotations).errors
        return float(-options.scale * errors.max())

    def best(**traits: bool) -> Family:
        return named("Best", "minus the largest error", lambda gt, est: 0.0, "fail", **traits)

    score = TrialMetric(best(larger_is_better=True), accuracy, Scale)
    monkeypatch.setitem(METRICS, "Best", score)
    noise = ["n_outliers=[0]", "sigma_t=[0.02]", "sigma_r_deg=[0.1,10]"]
    table = run(small(*noise, "trials=2", "metrics=[Best,'Best(scale=2)']"))
    assert list(table.columns) == [*KEY_COLUMNS, "Best", "Best(scale=2)"]
    assert (table["Best(scale=2)"] == 2 * table["Best"]).all()
    assert (table["Best"] < 0).all()
    tau = power(table, "Best", ["sigma_r_deg"], "smallest")
    assert tau == pytest.approx(2 / 6**0.5)  # the four pairs at different levels are in order
    monkeypatch.setitem(METRICS, "Best", TrialMetric(best(), accuracy))
    Column.parse.cache_clear()  # the registry never changes otherwise
    assert power(table, "Best", ["sigma_r_deg"], "smallest") == -tau
    with pytest.raises(ConfigError, match="has no option 'scale'; the options are none"):
        Column.parse("Best(scale=2)")


def test_protocols_are_metrics_by_their_names(
    small: Callable[..., Sweep], run: Callable[..., pd.DataFrame]
) -> None:
    """With commas and colons, in a sweep; what one refuses is no number."""
    names = [
        "auc@30:vggt",
        "recall@1m,9deg:hloc-sim3",
        "auc@5:colmap-imc",
        "ate:rmse",
        "are:rmse",
    ]
    metrics = to_overrides({"metrics": ["ATE", *names, "kitti"]})
    sweep = small("n_outliers=[2]", "sigma_t=[0.02]", "sigma_r_deg=[3]", "trials=2", *metrics)
    table = run(sweep)
    assert list(table.columns) == [*KEY_COLUMNS, "ATE", *names, "kitti"]
    assert table["kitti"].isna().all()  # no path of 100 m
    assert table["ate:rmse"].to_numpy() == pytest.approx(table["ATE"].to_numpy())
    (cell,) = cells(sweep)
    for trial, row in table.iterrows():
        cameras, seed = trial_seeds(sweep, cell, trial)
        scene = draw_scene(sweep, cell, cameras)
        gt, est = (
            (scene.gt_positions, scene.gt_rotations),
            (scene.est_positions, scene.est_rotations),
        )
        for name in names:
            assert row[name] == protocol(name)(*gt, *est, rng=seed)
    kinds = {name: Column.parse(name).metric.family for name in [*names, "kitti"]}
    assert [kind.larger_is_better for kind in kinds.values()] == [True] * 3 + [False] * 3
    assert [kind.unit for kind in kinds.values()] == ["%", "%", "%", "units", "deg", "%"]
    assert [name for name, kind in kinds.items() if kind.ordered] == ["kitti"]
