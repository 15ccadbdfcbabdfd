"""Metrics with options are paired: one alignment, one set of errors, scored many times."""

from collections.abc import Callable
from math import ceil

import numpy as np
import pytest
from scipy.spatial.distance import cdist

import experiments.metrics
from alignscores import pas, ras, tas
from alignscores.registration import pcr99
from experiments.cameras import Scene
from experiments.config import Config, ConfigError, split_metric
from experiments.metrics import Evaluation, evaluate
from experiments.sweep import Cell, draw_scene

SEED = np.random.SeedSequence(7)
THRESHOLDS = (0.25, 0.5, 1.0, 2.0, 4.0)


@pytest.fixture
def scene(small: Callable[..., Config]) -> Scene:
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
    together = [evaluation.value(metric) for metric in metrics]
    assert len(calls) == 1
    assert together == [Evaluation(scene, SEED).value(metric) for metric in metrics]
    calls.clear()
    evaluation.value("TAS(n_hypotheses=30)")
    evaluation.value("TAS(n_hypotheses=30, max_threshold=2)")
    evaluation.value("TAS(seed=1)")
    assert len(calls) == 2


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


def test_plain_metrics_are_those_of_the_library(scene: Scene) -> None:
    values = evaluate(scene, ["TAS", "RAS", "PAS", "PAS(weight=0.3)"], SEED)
    scores = pas(scene.gt_poses, scene.est_poses, rng=SEED)
    assert (values["TAS"], values["RAS"]) == (scores.tas.score, scores.ras.score)
    assert values["PAS"] == scores.score
    assert (
        values["PAS(weight=0.3)"]
        == pas(scene.gt_poses, scene.est_poses, rng=SEED, weight=0.3).score
    )


def test_a_seed_of_the_registration_is_another_in_each_trial(scene: Scene) -> None:
    own = [
        evaluate(scene, ["TAS(seed=0)"], np.random.SeedSequence(0, spawn_key=(trial,)))[
            "TAS(seed=0)"
        ]
        for trial in range(8)
    ]
    assert len(set(own)) > 1


def test_pas_under_another_registration(scene: Scene) -> None:
    values = evaluate(scene, ["PAS(registration=refined, weight=0.3)"], SEED)
    expected = pas(scene.gt_poses, scene.est_poses, rng=SEED, weight=0.3, registration="refined")
    assert list(values.values()) == [expected.score]


@pytest.mark.parametrize("quantile", [0.02, 0.25, 0.5, 0.6, 0.75, 0.9, 1])
def test_the_quantile_that_is_d(scene: Scene, quantile: float) -> None:
    unit = closest(scene)[ceil(round(quantile * 45, 6)) - 1]
    metric = f"TAS(quantile={quantile}, n_thresholds=inf)"
    errors = tas(scene.gt_positions, scene.est_positions, rng=SEED).errors
    area = np.maximum(0, 1 - errors / unit).mean()
    assert evaluate(scene, [metric], SEED)[metric] == pytest.approx(area, rel=1e-9)


def test_the_papers_values_written_out_change_no_bit(small: Callable[..., Config]) -> None:
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
            registration=lambda *clouds, order, o=order, p=prescreen, **settings: pcr99(
                *clouds, order=o, prescreen=p, **settings
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
    ("metric", "named"),
    [
        ("TAS(max_threshold=-1)", "max_threshold must be a positive number"),
        ("TAS(max_threshold=inf)", "max_threshold must be"),
        ("TAS(max_threshold=much)", "max_threshold must be"),
        ("TAS(n_thresholds=2.5)", "n_thresholds must be a positive whole number or inf"),
        ("TAS(quantile=0)", "quantile must be above 0"),
        ("TAS(n_hypotheses=0)", "n_hypotheses must be"),
        ("TAS(prescreen=0)", "prescreen must be"),
        ("TAS(order=1.5)", "order must be"),
        ("TAS(registration=umeyama)", "registration must be pcr99 or refined"),
        ("TAS(registration=refined, order=0.2)", "belong to pcr99 alone"),
        ("TAS(seed=-1)", "seed must be"),
        ("RAS(n_thresholds=True)", "n_thresholds must be"),
        ("PAS(weight=1.1)", "weight must be from 0 to 1"),
        ("mAA(fold_sign=1)", "fold_sign must be True or False"),
        ("PAS(order=0.2)", "no option 'order'"),
    ],
)
def test_impossible_options_are_refused(metric: str, named: str) -> None:
    with pytest.raises(ConfigError, match=named):
        split_metric(metric)
