"""A claim that is false in the trials is not reproduced, one that is true is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest

from experiments.grid import Cell
from experiments.metrics import Column
from experiments.tables import Trials
from studies.claims.claims import Claim, Criterion, load_claims
from studies.claims.plan import needed_cells, plan
from studies.claims.verdicts import (
    _by_other_criteria,
    decide,
    evaluate_claim,
    populations,
    reading_title,
    select_trials,
    verdict,
)

TRIALS, REPLICATES = 8, 3
CLAIMS = load_claims(REPLICATES)
SWEEPS = {(sweep.name, tuple(sweep.changes.split())): sweep for sweep in plan(CLAIMS.needed(0))}


@dataclass
class At:
    """Where a value is made up: a metric of a claim in a trial of a cell."""

    claim: Claim
    metric: str
    cell: Cell
    trial: int
    noise: float

    def shrunken(self, share: float) -> float:
        """Have a range that is smaller by a share in the cells after the change."""
        after = self.cell.matches(self.claim.after) and not self.cell.matches(self.claim.before)
        return (1 - share if after else 1) * (self.trial / (TRIALS - 1) + 1e-3 * self.cell.sigma_t)

    def here(self) -> bool:
        """Tell whether it is where the claim is local."""
        return self.cell.matches(self.claim.at)

    def worse(self) -> float:
        """Get worse with every level."""
        sign = -1 if Column.parse(self.metric).metric.family.larger_is_better else 1
        levels = sum(getattr(self.cell, level) / 10 for level in self.claim.level)
        return sign * (levels + 1e-3 * self.noise)


Values = Callable[[At], float]

MADE_UP: dict[str, Values] = {
    "blind": lambda at: at.noise,
    "improves": lambda at: -at.worse(),
    "moves": lambda at: at.cell.n_cameras / 200 + at.cell.sigma_t,
    "stays": lambda at: at.cell.sigma_t,
    "early": lambda at: {0: 0.0, 1: 0.9, 50: 1.0}[at.cell.n_outliers],
    "late": lambda at: {0: 0.0, 1: 0.1, 50: 1.0}[at.cell.n_outliers],
    "narrow": lambda at: at.trial / (TRIALS - 1),
    "wide": lambda at: 2 * at.trial / (TRIALS - 1),
    "moves here": lambda at: at.cell.n_cameras / 200 * at.here() + at.cell.sigma_t,
    "moves there": lambda at: at.cell.n_cameras / 200 * (not at.here()) + at.cell.sigma_t,
}


def columns(claim: Claim, *, holds: bool) -> list[Values]:
    """What the metrics of a claim must look like for it to hold, or not to."""
    relation = (claim.criterion or "").rpartition(" ")[0]
    if claim.statistic == "power":
        discerning = holds == (relation == "at least")
        return [At.worse, MADE_UP["blind"]] if discerning else [MADE_UP["blind"], At.worse]
    if claim.statistic == "improvement":
        return [MADE_UP["improves"] if holds else At.worse]
    if claim.statistic in ("dependence", "mean change") and claim.versus is None:
        return [MADE_UP["stays"] if holds == (relation != "at least") else MADE_UP["moves"]]
    if claim.statistic == "relative dependence":
        return [MADE_UP["stays"] if holds else MADE_UP["moves"], MADE_UP["moves"]]
    if claim.statistic == "relative dependence change":
        return [MADE_UP["moves there" if holds else "moves here"], MADE_UP["moves"]]
    if claim.statistic == "relative initial response":
        return [MADE_UP["late"] if holds else MADE_UP["early"], MADE_UP["early"]]
    if claim.statistic == "range change":
        assert claim.paper is not None
        share = -claim.paper / 100 if holds else 0.3
        return [lambda at: at.shrunken(share)]
    pairs: dict[str, list[Values]] = {
        "size of range change": [lambda at: at.shrunken(0.1), lambda at: at.shrunken(0.6)],
        "relative range": [MADE_UP["narrow"], MADE_UP["narrow"] if holds else MADE_UP["wide"]],
        "dependence": [MADE_UP["stays"], MADE_UP["moves"]],
        "initial response": [MADE_UP["late"], MADE_UP["early"]],
    }
    pair = pairs[claim.statistic]
    return pair if holds else pair[::-1]


def fabricate(claim: Claim, makers: Sequence[Values], seed: int) -> pd.DataFrame:
    """Make trials whose metrics are so, each of them of the claim."""
    rng = np.random.default_rng(seed)
    metrics = dict(zip(claim.metrics, makers, strict=False))
    return pd.DataFrame(
        [
            vars(cell)
            | {
                name: make(At(claim, name, cell, trial, rng.random()))
                for name, make in metrics.items()
            }
            | {"trial": trial}
            for cell in needed_cells(claim, SWEEPS[claim.trials])
            for trial in range(TRIALS)
        ]
    )


def verdict_on(claim: Claim, makers: Sequence[Values]) -> str:
    tables = [fabricate(claim, makers, seed) for seed in range(REPLICATES)]
    return verdict(claim, np.array([evaluate_claim(claim, table) for table in tables]))


@pytest.mark.slow
@pytest.mark.parametrize("name", CLAIMS.claims)
def test_every_claim_can_hold_and_can_fail(name: str) -> None:
    claim = CLAIMS.claims[name]
    assert verdict_on(claim, columns(claim, holds=True)) == "reproduced"
    assert verdict_on(claim, columns(claim, holds=False)) == "not reproduced"


DISCERNING = [
    claim
    for claim in CLAIMS.claims.values()
    if claim.statistic == "power" and claim.versus is None and claim.bound[0] == "at least"
]


@pytest.mark.parametrize("claim", DISCERNING, ids=lambda claim: claim.id)
def test_a_metric_that_gets_better_with_noise_discerns_nothing(claim: Claim) -> None:
    assert verdict_on(claim, [MADE_UP["improves"]]) == "not reproduced"


NUMBER = CLAIMS.claims["outliers-range-maa"]  # -74
SMALL = CLAIMS.claims["combined-range-pas-rotation"]  # 13
POWER = CLAIMS.claims["outliers-tas-discerns"]  # at least 0.5
WEAK = CLAIMS.claims["outliers-ate-blind"]  # below 0.5
WITHIN = CLAIMS.claims["thresholds-ras-lower"]  # within 20


@pytest.mark.parametrize(
    ("claim", "values", "expected"),
    [
        (NUMBER, [-75, -74, -73], "reproduced"),
        (NUMBER, [-74.4, -74.45, -74.48], "reproduced"),  # -74 is rounded
        (NUMBER, [-74.6, -74.7, -74.65, -74.6, -74.7, -74.65], "not reproduced"),
        (NUMBER, [-71, -72, -70], "inconclusive"),  # three studies cannot exclude a fourth of -74
        (NUMBER, [-71, -72, -70] * 10, "not reproduced"),
        (NUMBER, [-60, -60, -60], "not reproduced"),
        (NUMBER, [-120, 40, -74], "inconclusive"),  # not even the direction is certain
        (NUMBER, [-1, 0, 1] * 10, "not reproduced"),  # it is not -74, whatever the direction
        (SMALL, [-12, 0, 12.6] * 10, "inconclusive"),  # rounding does not make it certain
        (NUMBER, [-74.5] * 3, "reproduced"),
        (NUMBER, [-74.51] * 3, "not reproduced"),
        # A fourth of -73.5 is 4.30 sd from one study, 4.97 sd from the mean of three.
        (NUMBER, [-69.9, -68.9, -67.9], "inconclusive"),
        (NUMBER, [-69.4, -68.4, -67.4], "not reproduced"),
        (NUMBER, [np.nan, -74, -74], "inconclusive"),
        # The central 95 % leave out one of 41 on either side, but not one of 21.
        (POWER, [0.4] + [0.55] * 20, "inconclusive"),
        (POWER, [0.4] + [0.55] * 40, "reproduced"),
        (WEAK, [0.6] + [0.45] * 20, "inconclusive"),
        (WEAK, [0.6] + [0.45] * 40, "reproduced"),
        (POWER, [0.5, 0.5], "reproduced"),
        (WEAK, [0.5, 0.5], "not reproduced"),
        (WITHIN, [20, 20], "reproduced"),
        (WITHIN, [-20, -20], "reproduced"),
        (WITHIN, [20.1, 20.1], "not reproduced"),
        (POWER, [0.9, 0.8], "reproduced"),
        (POWER, [0.4, 0.3], "not reproduced"),
        (POWER, [0.6, 0.4], "inconclusive"),
        (WEAK, [0.1, 0.2], "reproduced"),
        (WEAK, [0.6, 0.7], "not reproduced"),
        (WEAK, [0.1, 0.7], "inconclusive"),
        (WITHIN, [-19, 19], "reproduced"),
        (WITHIN, [-40, -30], "not reproduced"),
        (WITHIN, [-40, 40], "inconclusive"),
        (WITHIN, [10, 40], "inconclusive"),
    ],
)
def test_verdicts(claim: Claim, values: list[float], expected: str) -> None:
    assert verdict(claim, np.array(values, dtype=float)) == expected


@pytest.mark.parametrize(
    ("claim", "values", "expected"),
    [
        # Means of 0.52 and 0.48 with a standard error of 0.01 each are 2 of these from the bound.
        (POWER, [0.5, 0.54] * 2, "open"),
        (POWER, [0.59, 0.6, 0.61] * 2, "true"),
        (POWER, [0.39, 0.4, 0.41] * 2, "false"),
        (WEAK, [0.39, 0.4, 0.41] * 2, "true"),
        (NUMBER, [-74.1, -74, -73.9] * 2, "true"),  # between -74.5 and -73.5
        (NUMBER, [-74.6, -74.4, -74.5] * 2, "open"),
        (NUMBER, [-76.1, -76, -75.9] * 2, "false"),  # though one study may well show it
        (WITHIN, [-30, -31, -32] * 2, "false"),
        (WITHIN, [0, 1, -1] * 2, "true"),
        (POWER, [0.5, 0.5], "true"),  # nothing scatters
        (WEAK, [0.5, 0.5], "false"),
        (POWER, [np.nan, 0.9], "open"),
    ],
)
def test_populations(claim: Claim, values: list[float], expected: str) -> None:
    assert populations([claim], [np.array(values, dtype=float)]) == [expected]


def test_a_single_study_may_be_open_where_the_population_is_not() -> None:
    """As of the TAS's response to a first outlier: 29 % in the mean, but from -16 to 94."""
    values = np.linspace(-16, 74, 20)
    claim = CLAIMS.claims["gentle-tas-much-than-dte"]
    assert verdict(claim, values) == "inconclusive"
    assert populations([claim], [values]) == ["true"]


def test_the_more_claims_the_less_is_certain() -> None:
    """The p-value of a mean of 0.6 with a standard error of 0.0283, 0.024, is no news of three."""
    values = np.array([0.52, 0.56, 0.6, 0.64, 0.68])
    assert populations([POWER], [values]) == ["true"]
    assert populations([POWER] * 3, [values] * 3) == ["open"] * 3
    assert populations([POWER] * 2, [values, values + 0.3]) == ["true"] * 2  # Holm steps down


def test_movements_count_where_a_claim_says_in_the_range_everywhere() -> None:
    claim = CLAIMS.claims["table1-tas-length"]
    table = fabricate(claim, [lambda at: at.cell.sigma_t * (1 + at.cell.n_cameras / 190)], seed=0)
    local = replace(claim, at={"sigma_t": [0.05]})
    widest = table["TAS"].max() - table["TAS"].min()
    assert evaluate_claim(local, table) == pytest.approx(100 * 0.05 / widest)
    assert evaluate_claim(local, table) < evaluate_claim(claim, table)


def test_every_reading_has_both_verdicts_beside_those_taken() -> None:
    """Single trials scatter less under outliers; their means rise with the noise all the same."""
    table = fabricate(NUMBER, columns(NUMBER, holds=True), seed=0)
    scatter = np.where(table["trial"] % 2, 1, -1) * np.where(table["n_outliers"] == 0, 1, 0.26)
    table["mAA"] = scatter + 1e-4 * table["sigma_t"]
    decisions = [decision for decision in CLAIMS.decisions if decision.id in ("range", "volume")]
    few = {"a": NUMBER, "b": replace(NUMBER, implied_by=["a"])}
    claims = replace(CLAIMS, claims=few, decisions=decisions, replicates_of_readings=2)
    verdicts, readings, _ = decide(claims, [{NUMBER.trials: table}] * 3)
    assert verdicts["ours"].tolist() == [-74, -74]
    assert verdicts["replicates"].tolist() == [3, 3]
    assert verdicts["implied_by"].fillna("").tolist() == ["", "a"]
    assert verdicts["verdict"].tolist() == ["reproduced"] * 2
    assert verdicts["population"].tolist() == ["true"] * 2
    volume, of_range = decisions
    assert (
        verdicts[reading_title(of_range, of_range.readings[1])].tolist()
        == ["not reproduced, false"] * 2
    )
    assert verdicts[reading_title(volume, volume.readings[1])].isna().all()
    assert readings["reading"].tolist() == ["taken"] * 2 + ["mean curve"] * 2
    assert readings["claim"].tolist() == ["a", "b"] * 2
    assert readings["ours"].tolist() == [-74, -74, 0, 0]
    assert readings["replicates"].tolist() == [2] * 4
    assert readings["paper_says"].tolist()[2:] == [of_range.paper] * 2


def test_trials_of_all_replicates_are_pooled() -> None:
    """The range of each study is 1 before and 0.5 after; of both together it is 3 and 0.5."""
    tables = [fabricate(NUMBER, [lambda at: at.shrunken(0.5)], seed=0) for _ in range(2)]
    tables[1]["mAA"] += 2 * (tables[1]["n_outliers"] == 0)
    claims = replace(CLAIMS, claims={"a": NUMBER}, decisions=[])
    verdicts, *_ = decide(claims, [{NUMBER.trials: table} for table in tables])
    assert verdicts["ours"].tolist() == pytest.approx([-50], abs=0.1)
    assert verdicts["pooled"].tolist() == pytest.approx([-100 * 2.5 / 3], abs=0.1)


def test_other_bounds_change_verdicts() -> None:
    """A tau of 0.4 to 0.6: not certainly 0.5, certainly 0.3, certainly not 0.7."""
    claims = replace(
        CLAIMS,
        claims={"tau": POWER, "weak": WEAK, "within": WITHIN},
        criteria=[Criterion("discern", 0.5, [0.3, 0.7])],
    )
    values = [np.array([0.4, 0.5, 0.6] * 9)] * 2 + [np.zeros(27)]
    found = _by_other_criteria(claims, values).set_index("other")
    assert found["claims"].tolist() == [2, 2]  # not the one with another bound
    assert found["changed"].tolist() == [2, 2]
    assert found.at[0.3, "changes"] == "tau: reproduced; weak: not reproduced"
    assert found.at[0.7, "changes"] == "tau: not reproduced; weak: reproduced"
    assert found["population_changed"].tolist() == [2, 2]


MakeUp = Callable[..., Trials]


def test_trials_of_a_replicate_are_selected_by_experiment_and_settings(make_up: MakeUp) -> None:
    sweeps = [replace(sweep, trials=1) for sweep in SWEEPS.values()]
    trials = make_up(*sweeps, value=lambda *_: 0.5)
    tables = select_trials(trials)
    assert set(tables) == set(SWEEPS)
    for (name, settings), table in tables.items():
        assert set(table["experiment"]) == {name}
        assert set(table["settings"]) == {" ".join(settings)}
    assert sum(map(len, tables.values())) == len(trials.table)
