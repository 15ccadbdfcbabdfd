"""A claim that is false in the trials is not reproduced, one that is true is."""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.claims import Claim, load_claims
from experiments.config import load
from experiments.replicate import cells_of, plan, replicate_path
from experiments.statistics import SCORES
from experiments.sweep import Cell
from experiments.tables import write_table
from experiments.verdicts import decide, evaluate_claim, main, verdict

TRIALS, REPLICATES = 8, 4
CLAIMS = load_claims(REPLICATES)
PLAN = plan(CLAIMS)

Column = Callable[[Claim, Cell, int, np.random.Generator], float]


def blind(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return float(rng.random())


def follows(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    """Rises with every level, in an error; falls in a score."""
    return sum(getattr(cell, level) / 10 for level in claim.level) + 1e-3 * rng.random()


def favours(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    sign = 1 if claim.metric in SCORES else -1
    return sign * follows(claim, cell, trial, rng)


def disfavours(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return -favours(claim, cell, trial, rng)


def shrinks(share: float) -> Column:
    """Has a range that is smaller by a share in the cells after the change."""

    def column(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
        changed = all(getattr(cell, key) in values for key, values in claim.after.items())
        fixed = all(getattr(cell, key) in values for key, values in claim.before.items())
        scale = 1 - share if changed and not fixed else 1.0
        return scale * (trial / (TRIALS - 1) + 1e-3 * cell.sigma_t)

    return column


def wide(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return 2 * trial / (TRIALS - 1)


def narrow(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return trial / (TRIALS - 1)


def moves(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return cell.n_cameras / 200 + cell.sigma_t


def stays(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return cell.sigma_t


def early(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return {0: 0.0, 1: 0.9, 50: 1.0}[cell.n_outliers]


def late(claim: Claim, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return {0: 0.0, 1: 0.1, 50: 1.0}[cell.n_outliers]


def columns(claim: Claim, *, holds: bool) -> list[Column]:
    """What the metrics of a claim must look like for it to hold, or not to."""
    if claim.statistic == "power":
        discerning = holds == (claim.bound[0] == "at least")
        both: list[Column] = [follows, blind] if discerning else [blind, follows]
        return both
    if claim.statistic == "favour":
        return [favours] if holds else [disfavours]
    if claim.statistic == "range change":
        assert claim.paper is not None
        return [shrinks(-claim.paper / 100 if holds else 0.3)]
    pairs: dict[str, list[Column]] = {
        "unsteadiness": [shrinks(0.1), shrinks(0.6)],
        "relative range": [narrow, narrow if holds else wide],
        "dependence": [stays, moves],
        "first step": [late, early],
    }
    pair = pairs[claim.statistic]
    return pair if holds else pair[::-1]


def fabricate(claim: Claim, *, holds: bool, seed: int) -> pd.DataFrame:
    """Make trials in which a claim holds, or does not."""
    rng = np.random.default_rng(seed)
    config, _ = PLAN[claim.trials]
    makers = dict(zip(claim.metrics, columns(claim, holds=holds), strict=False))
    return pd.DataFrame(
        [
            asdict(cell)
            | {name: make(claim, cell, trial, rng) for name, make in makers.items()}
            | {"trial": trial}
            for cell in cells_of(claim, config)
            for trial in range(TRIALS)
        ]
    )


@pytest.mark.parametrize("name", CLAIMS.claims)
def test_every_claim_can_hold_and_can_fail(name: str) -> None:
    claim = CLAIMS.claims[name]
    for holds, expected in ((True, "reproduced"), (False, "not reproduced")):
        tables = [fabricate(claim, holds=holds, seed=seed) for seed in range(REPLICATES)]
        values = np.array([evaluate_claim(claim, table) for table in tables])
        assert verdict(claim, values) == expected, values


NUMBER = CLAIMS.claims["outliers-range-maa"]  # -74
POWER = CLAIMS.claims["outliers-tas-discerns"]  # at least 0.5
BLIND = CLAIMS.claims["outliers-ate-blind"]  # below 0.5
WITHIN = CLAIMS.claims["thresholds-ras-max-threshold-deg-8"]  # within 20


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
        (NUMBER, [np.nan, -74, -74], "inconclusive"),
        (POWER, [0.9, 0.8], "reproduced"),
        (POWER, [0.4, 0.3], "not reproduced"),
        (POWER, [0.6, 0.4], "inconclusive"),
        (BLIND, [0.1, 0.2], "reproduced"),
        (BLIND, [0.6, 0.7], "not reproduced"),
        (BLIND, [0.1, 0.7], "inconclusive"),
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
    table = fabricate(NUMBER, holds=True, seed=0)
    scatter = np.where(table["trial"] % 2, 1, -1) * np.where(table["n_outliers"] == 0, 1, 0.26)
    table["mAA"] = scatter + 1e-4 * table["sigma_t"]
    claims = replace(CLAIMS, claims={NUMBER.id: NUMBER}, decisions=[])
    (row,) = decide(claims, [{NUMBER.trials: table}] * 2)[0].to_dict("records")
    assert (row["ours"], row["verdict"], row["replicates"]) == (-74, "reproduced", 2)
    assert (row["ours_of_means"], row["verdict_of_means"]) == (0, "not reproduced")


def write_replicates(results: Path, *, holds: bool) -> None:
    """Write tables in which every metric follows everything, or nothing."""
    for number in range(2):
        rng = np.random.default_rng(number)
        config = load(["experiment=outliers", f"results_dir={results}", f"replicate={number}"])
        rows = []
        for (experiment, settings), (own, wanted) in PLAN.items():
            for cell, metrics in wanted.items():
                for trial in range(2):
                    row = {"experiment": experiment, "settings": " ".join(settings)}
                    row |= {"geometry": own.geometry, **asdict(cell)}
                    row |= {"replicate": number, "trial": trial}
                    value = 10 * cell.sigma_t + cell.sigma_r_deg + cell.n_outliers / 10
                    for metric in metrics:
                        row[metric] = value if holds else rng.random()
                    rows.append(row)
        write_table(replicate_path(config), pd.DataFrame(rows), {})


def test_command_line_writes_claims_and_decisions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["replicates=2", f"results_dir={tmp_path}"]
    verdicts = []
    for holds in (True, False):
        write_replicates(tmp_path, holds=holds)
        assert main(arguments) == 0
        table = pd.read_csv(tmp_path / "claims.csv").set_index("id")
        assert list(table.index) == list(CLAIMS.claims)
        assert (table["replicates"] == 2).all()
        verdicts.append(table["verdict"])
    discerning, blind_ones = verdicts
    assert discerning["outliers-tas-discerns"] == "reproduced"
    assert discerning["outliers-ate-blind"] == "not reproduced"
    assert blind_ones["outliers-tas-discerns"] == "not reproduced"
    decisions = pd.read_csv(tmp_path / "tables" / "decisions.csv")
    assert set(decisions["decision"]) == {decision.id for decision in CLAIMS.decisions}
    assert "claims.csv" in capsys.readouterr().out


def test_missing_and_foreign_tables_are_named_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["replicates=2", f"results_dir={tmp_path}"]
    assert main(arguments) == 1
    error = capsys.readouterr().err
    assert "0.csv does not exist; run: python -m experiments.replicate replicate=0" in error
    write_replicates(tmp_path, holds=True)
    path = tmp_path / "replicates" / "1.csv"
    whole = path.read_text()
    for content, reason in (
        ("", "cannot be read"),
        ("a,b\n1,2\n", "has no column"),
        ("\n".join(whole.splitlines()[:50]) + "\n", "lacks the trials of claim"),
    ):
        path.write_text(content)
        assert main(arguments) == 1
        error = capsys.readouterr().err
        assert f"{path} {reason}" in error
        assert error.count("\n") == 1
    assert not (tmp_path / "claims.csv").exists()


@pytest.mark.parametrize("setting", ["replicates=1", "replicates=x", "trails=3", "metrics=[TAS]"])
def test_wrong_settings_end_with_one_line(
    setting: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([f"results_dir={tmp_path}", setting]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert setting.partition("=")[0] in error
