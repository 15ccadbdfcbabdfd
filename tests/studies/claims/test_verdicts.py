"""A claim that is false in the trials is not reproduced, one that is true is."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from experiments.command import CommandError
from experiments.config import Sweep
from experiments.grid import Cell
from experiments.metrics import Column
from experiments.tables import Record, TableError, Trials
from studies.claims.claims import Claim, load_claims
from studies.claims.plan import needed_cells, plan
from studies.claims.verdicts import check_alike, decide, evaluate_claim, select_trials, verdict

TRIALS, REPLICATES = 8, 4
CLAIMS = load_claims(REPLICATES)
SWEEPS = {(sweep.name, tuple(sweep.differs.split())): sweep for sweep in plan(CLAIMS)}


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

    def worse(self) -> float:
        """Get worse with every level."""
        sign = -1 if Column.parse(self.metric).metric.higher_is_better else 1
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
}


def columns(claim: Claim, *, holds: bool) -> list[Values]:
    """What the metrics of a claim must look like for it to hold, or not to."""
    relation = (claim.criterion or "").rpartition(" ")[0]
    if claim.statistic == "power":
        discerning = holds == (relation == "at least")
        return [At.worse, MADE_UP["blind"]] if discerning else [MADE_UP["blind"], At.worse]
    if claim.statistic == "improvement":
        return (
            [MADE_UP["blind"] if relation == "within" else MADE_UP["improves"]]
            if holds
            else [At.worse]
        )
    if claim.statistic == "relative dependence":
        return [MADE_UP["stays"] if holds else MADE_UP["moves"], MADE_UP["moves"]]
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
            asdict(cell)
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


def test_the_other_meaning_of_range_is_computed_beside() -> None:
    """Single trials scatter less under outliers; their means rise with the noise all the same."""
    table = fabricate(NUMBER, columns(NUMBER, holds=True), seed=0)
    scatter = np.where(table["trial"] % 2, 1, -1) * np.where(table["n_outliers"] == 0, 1, 0.26)
    table["mAA"] = scatter + 1e-4 * table["sigma_t"]
    claims = replace(CLAIMS, claims={NUMBER.id: NUMBER}, decisions=[])
    (row,) = decide(claims, [{NUMBER.trials: table}] * 2)[0].to_dict("records")
    assert (row["ours"], row["verdict"], row["replicates"]) == (-74, "reproduced", 2)
    assert (row["ours_of_means"], row["verdict_of_means"]) == (0, "not reproduced")


def test_decisions_show_every_reading_of_their_claims() -> None:
    decision = next(one for one in CLAIMS.decisions if one.id == "volume")
    few = {name: CLAIMS.claims[name] for name in decision.claims}
    claims = replace(CLAIMS, claims=few, decisions=[decision])
    tables = {
        reading.of(claim).trials: fabricate(reading.of(claim), columns(claim, holds=True), 0)
        for claim in few.values()
        for reading in decision.readings
    }
    _, evidence = decide(claims, [tables] * 2)
    readings = [reading.reading for reading in decision.readings]
    assert evidence["reading"].tolist() == [one for one in readings for _ in few]
    assert evidence["claim"].tolist() == [*few] * len(readings)
    assert set(evidence["decision"]) == {"volume"}
    assert evidence["paper_says"].tolist() == [decision.paper] * len(evidence)


MakeUp = Callable[..., Trials]


@pytest.fixture(scope="module")
def replicate(make_up: MakeUp) -> MakeUp:
    """A replicate study of other sweeps than the claims need, or of theirs."""

    def of(*sweeps: Sweep, number: int = 0) -> Trials:
        chosen = [replace(one, trials=1, replicate=number) for one in sweeps or SWEEPS.values()]
        return make_up(*chosen, value=lambda *_: 0.5, path=f"{number}.csv")

    return of


def test_trials_of_a_replicate_are_selected_by_experiment_and_settings(replicate: MakeUp) -> None:
    trials = replicate()
    tables = select_trials(CLAIMS, trials)
    assert set(tables) == set(SWEEPS)
    for (name, settings), table in tables.items():
        assert set(table["experiment"]) == {name}
        assert set(table["settings"]) == {" ".join(settings)}
    assert sum(map(len, tables.values())) == len(trials.table)


@pytest.mark.parametrize(
    ("key", "change", "problem"),
    [
        (("rotations", ()), None, "has no trials for the claim 'rotations-"),
        (("outliers", ()), {"n_outliers": [0, 1]}, "cannot decide the claims: claim 'outliers-"),
        (("outliers", ()), {"sigma_t": [0.05]}, "cannot decide the claims: claim 'outliers-"),
        (("combined", ()), {"only": 1}, "lacks trials for the claim 'combined-"),
    ],
)
def test_trials_that_do_not_decide_the_claims_are_refused(
    replicate: MakeUp, key: tuple[str, tuple[str, ...]], change: dict[str, Any] | None, problem: str
) -> None:
    sweeps = dict(SWEEPS)
    if change is None:
        del sweeps[key]
    elif "only" in change:
        sweeps[key] = replace(sweeps[key], only=sweeps[key].only[:1])
    else:
        sweeps[key] = replace(sweeps[key], **change)
    with pytest.raises(TableError, match=rf"^0\.csv {problem}.*; run: snakemake 0\.csv$"):
        select_trials(CLAIMS, replicate(*sweeps.values()))


def test_values_that_are_missing_are_refused(replicate: MakeUp) -> None:
    """Those that no claim needs are, in any replicate."""
    trials = replicate()
    table = trials.table.copy()
    needed = table["TAS"].notna()
    table.loc[needed.idxmax(), "TAS"] = np.nan
    with pytest.raises(TableError, match=r"^0\.csv lacks values in trials of \w+; run: snakemake"):
        select_trials(CLAIMS, replace(trials, table=table))
    assert not needed.all()


def test_replicates_differ_in_their_number_alone() -> None:
    first, second = ([replace(one, replicate=k) for one in SWEEPS.values()] for k in (0, 1))
    paths = [Path("0.csv"), Path("1.csv")]

    def check(*sweeps: list[Sweep]) -> None:
        check_alike(paths[: len(sweeps)], [Record(tuple(own), {}) for own in sweeps])

    check(first, second)
    with pytest.raises(CommandError, match="at least two replicate studies"):
        check(first)
    others = [replace(second[0], seed=1), *second[1:]]
    for other in (others, second[:-1]):
        with pytest.raises(TableError, match=r"^1\.csv has other settings than 0\.csv; run: "):
            check(first, other)
    for other in (first, [*second[:-1], first[-1]]):
        with pytest.raises(TableError, match=r"^1\.csv is not replicate 1; run: snakemake 1\.csv"):
            check(first, other)
