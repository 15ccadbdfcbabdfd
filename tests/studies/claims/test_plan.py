"""The cells and metrics that the claims need, and the settings that leave them undecided."""

from dataclasses import replace

import pytest

from experiments.config import ConfigError, load_sweep
from experiments.grid import evaluations
from studies.claims.claims import load_claims
from studies.claims.plan import needed_cells, plan, replicates

CLAIMS = load_claims()


def test_the_plan_holds_the_cells_and_metrics_of_every_claim_and_no_more():
    planned = {
        (sweep.name, tuple(sweep.changes.split())): sweep for sweep in plan(CLAIMS.needed(0))
    }
    wanted = {key: evaluations(sweep) for key, sweep in planned.items()}
    assert set(planned) == {claim.trials for claim in CLAIMS.needed(0)}
    for key, sweep in planned.items():
        assert set().union(*wanted[key].values()) == set(sweep.metrics)
    # Single cells, worked out by hand.
    few = wanted["maa_vs_pas_outliers", ()]
    assert {cell.n_outliers for cell in few if cell.sigma_t in (0.02, 0.08)} == {0, 50}
    large = "trajectory_length", ("volume_per_camera=10",)
    assert planned[large].volume_per_camera == 10
    assert {metric for metrics in wanted[large].values() for metric in metrics} == {
        *("ATE", "DTE", "mAA", "TAS", "d")
    }


def test_replicates_differ_in_their_number_alone():
    tables = replicates(load_claims(3), ["trials=7"], range(3))
    assert len(tables) == 3
    first, *_, last = tables
    assert {sweep.replicate for sweep in last} == {2}
    assert {sweep.trials for sweep in last} == {7}
    assert tuple(replace(sweep, replicate=0) for sweep in last) == first
    assert len(first) == len({claim.trials for claim in CLAIMS.needed(0)})


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        ("metrics=[TAS]", "'metrics' cannot be set: the claims decide"),
        ("n_outliers=[0,1]", "needs trials of outliers with n_outliers 10"),
        ("trials=0", "'trials': should be greater than or equal to 1, not 0 (experiment="),
        ("trails=1", "Could not override 'trails'"),
    ],
)
def test_settings_that_leave_claims_undecided_are_refused(override, problem):
    with pytest.raises(ConfigError) as caught:
        replicates(CLAIMS, [override], [0])
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "least"),
    [
        ({"level": ["n_cameras"]}, 2),
        ({"level": ["sigma_t", "n_cameras"]}, 2),
        ({"where": {"sigma_t": [0.05]}, "level": ["sigma_t"]}, 2),
        (
            {
                "statistic": "initial response",
                "level": ["sigma_t"],
                "where": {"n_outliers": [0], "sigma_t": [0.01, 0.1]},
            },
            3,
        ),
    ],
)
def test_a_claim_needs_levels_to_compare(change, least):
    """Else it would have a verdict on nothing, after all trials."""
    name = "outliers-tas-discerns"
    with pytest.raises(ConfigError, match=f"'{name}' compares levels of .*, at least {least} of"):
        needed_cells(replace(CLAIMS.claims[name], **change), load_sweep(["experiment=outliers"]))
