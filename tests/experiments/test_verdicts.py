"""A claim that is false in the trials is not reproduced, one that is true is."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.claims import Claim, load_claims
from experiments.config import load, split_metric
from experiments.replicate import cells_of, plan, replicate_path
from experiments.statistics import SCORES
from experiments.sweep import Cell
from experiments.tables import provenance, write_table
from experiments.verdicts import decide, evaluate_claim, main, verdict

TRIALS, REPLICATES = 8, 4
CLAIMS = load_claims(REPLICATES)
PLAN = plan(CLAIMS)

Column = Callable[[Claim, str, Cell, int, np.random.Generator], float]  # str: the metric


def worse(metric: str) -> int:
    """Return the sign of a change for the worse."""
    return -1 if split_metric(metric)[0] in SCORES else 1


def blind(claim: Claim, metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return float(rng.random())


def worsens(claim: Claim, metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    """Gets worse with every level."""
    levels = sum(getattr(cell, level) / 10 for level in claim.level)
    return worse(metric) * (levels + 1e-3 * rng.random())


def improves(claim: Claim, metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return -worsens(claim, metric, cell, trial, rng)


def shrinks(share: float) -> Column:
    """Has a range that is smaller by a share in the cells after the change."""

    def column(
        claim: Claim, metric: str, cell: Cell, trial: int, rng: np.random.Generator
    ) -> float:
        changed = all(getattr(cell, key) in values for key, values in claim.after.items())
        fixed = all(getattr(cell, key) in values for key, values in claim.before.items())
        scale = 1 - share if changed and not fixed else 1.0
        return scale * (trial / (TRIALS - 1) + 1e-3 * cell.sigma_t)

    return column


def wide(claim: Claim, metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return 2 * trial / (TRIALS - 1)


def narrow(claim: Claim, metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return trial / (TRIALS - 1)


def moves(claim: Claim, metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return cell.n_cameras / 200 + cell.sigma_t


def stays(claim: Claim, metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return cell.sigma_t


def early(claim: Claim, metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return {0: 0.0, 1: 0.9, 50: 1.0}[cell.n_outliers]


def late(claim: Claim, metric: str, cell: Cell, trial: int, rng: np.random.Generator) -> float:
    return {0: 0.0, 1: 0.1, 50: 1.0}[cell.n_outliers]


def columns(claim: Claim, *, holds: bool) -> list[Column]:
    """What the metrics of a claim must look like for it to hold, or not to."""
    relation = (claim.criterion or "").rpartition(" ")[0]
    if claim.statistic == "power":
        discerning = holds == (relation == "at least")
        return [worsens, blind] if discerning else [blind, worsens]
    if claim.statistic == "favour":
        return [blind if relation == "within" else improves] if holds else [worsens]
    if claim.statistic == "relative dependence":
        return [stays if holds else moves, moves]
    if claim.statistic == "relative first step":
        return [late if holds else early, early]
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


def fabricate(claim: Claim, makers: Sequence[Column], seed: int) -> pd.DataFrame:
    """Make trials whose metrics are so, each of them of the claim."""
    rng = np.random.default_rng(seed)
    config, _ = PLAN[claim.trials]
    metrics = dict(zip(claim.metrics, makers, strict=False))
    return pd.DataFrame(
        [
            asdict(cell)
            | {name: make(claim, name, cell, trial, rng) for name, make in metrics.items()}
            | {"trial": trial}
            for cell in cells_of(claim, config)
            for trial in range(TRIALS)
        ]
    )


def verdict_on(claim: Claim, makers: Sequence[Column]) -> str:
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
    assert verdict_on(claim, [improves]) == "not reproduced"


NUMBER = CLAIMS.claims["outliers-range-maa"]  # -74
SMALL = CLAIMS.claims["combined-range-pas-rotation"]  # 13
POWER = CLAIMS.claims["outliers-tas-discerns"]  # at least 0.5
BLIND = CLAIMS.claims["outliers-ate-blind"]  # below 0.5
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
        (BLIND, [0.6] + [0.45] * 20, "inconclusive"),
        (BLIND, [0.6] + [0.45] * 40, "reproduced"),
        (POWER, [0.5, 0.5], "reproduced"),
        (BLIND, [0.5, 0.5], "not reproduced"),
        (WITHIN, [20, 20], "reproduced"),
        (WITHIN, [-20, -20], "reproduced"),
        (WITHIN, [20.1, 20.1], "not reproduced"),
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
    table = fabricate(NUMBER, columns(NUMBER, holds=True), seed=0)
    scatter = np.where(table["trial"] % 2, 1, -1) * np.where(table["n_outliers"] == 0, 1, 0.26)
    table["mAA"] = scatter + 1e-4 * table["sigma_t"]
    claims = replace(CLAIMS, claims={NUMBER.id: NUMBER}, decisions=[])
    (row,) = decide(claims, [{NUMBER.trials: table}] * 2)[0].to_dict("records")
    assert (row["ours"], row["verdict"], row["replicates"]) == (-74, "reproduced", 2)
    assert (row["ours_of_means"], row["verdict_of_means"]) == (0, "not reproduced")


def write_replicates(results: Path, sign: Callable[[str], int]) -> None:
    """Write tables in which every metric follows all noise and outliers, up, down or not at all."""
    for number in range(2):
        rng = np.random.default_rng(number)
        config = load([f"results_dir={results}", "trials=2", f"replicate={number}"])
        table = []
        for (experiment, settings), (own, wanted) in PLAN.items():
            for cell, metrics in wanted.items():
                row = {"experiment": experiment, "settings": " ".join(settings)}
                row |= {"geometry": own.geometry, **asdict(cell), "replicate": number}
                value = 10 * cell.sigma_t + cell.sigma_r_deg + cell.n_outliers / 10
                for trial in range(2):
                    values = {name: sign(name) * value + 1e-3 * rng.random() for name in metrics}
                    table.append(row | {"trial": trial} | values)
        write_table(replicate_path(config), pd.DataFrame(table), provenance(config))


def test_command_line_writes_claims_and_decisions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    verdicts = {}
    for sign in (worse, lambda metric: 0, lambda metric: 1):
        write_replicates(tmp_path, sign)
        assert main(["replicates=2", "trials=2", f"results_dir={tmp_path}"]) == 0
        table = pd.read_csv(tmp_path / "claims.csv").set_index("id")
        assert list(table.index) == list(CLAIMS.claims)
        assert (table["replicates"] == 2).all()
        for name, found in table["verdict"].items():
            verdicts.setdefault(name, []).append(found)
    # All metrics get worse; none follows anything; all rise, errors for the worse.
    yes, no = "reproduced", "not reproduced"
    for name in ("outliers-tas-discerns", "rotations-ras-noise", "combined-pas-both"):
        assert verdicts[name] == [yes, no, no]
    assert verdicts["outliers-ate-discerns"][::2] == [yes, yes]
    assert verdicts["outliers-ate-blind"][::2] == [no, no]
    decisions = pd.read_csv(tmp_path / "tables" / "decisions.csv")
    assert set(decisions["decision"]) == {decision.id for decision in CLAIMS.decisions}
    assert "claims.csv" in capsys.readouterr().out


def test_missing_and_foreign_tables_are_named_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["replicates=2", "trials=2", f"results_dir={tmp_path}"]
    assert main(arguments) == 1
    error = capsys.readouterr().err
    assert f"results_dir={tmp_path} replicate=0\n" in error
    write_replicates(tmp_path, worse)
    path = tmp_path / "replicates" / "1.csv"
    whole = path.read_text()
    lines = whole.splitlines(keepends=True)
    empty = pd.read_csv(path)
    empty.loc[empty.index[0], "TAS"] = None
    for content, reason in (
        ("", "cannot be read"),
        ("a,b\n1,2\n", "has no column experiment"),
        ("".join(lines[: len(lines) // 2]), f"has {len(lines) // 2 - 1} trials, not the"),
        (whole + lines[-1], f"has {len(lines)} trials, not the {len(lines) - 1} that"),
        (
            path.with_name("0.csv").read_text(),
            "has other trials than the claims need: see replicate",
        ),
        (empty.to_csv(index=False), "has other trials than the claims need: see TAS"),
    ):
        path.write_text(content)
        assert main(arguments) == 1
        error = capsys.readouterr().err
        assert f"{path} {reason}" in error
        assert (
            f"run: python -m experiments.replicate trials=2 results_dir={tmp_path} replicate=1"
            in error
        )
        assert error.count("\n") == 1
    assert not (tmp_path / "claims.csv").exists()
    path.write_text(whole)
    assert main([*arguments, "trials=3"]) == 1
    assert f"0.csv has {len(lines) - 1} trials, not the" in capsys.readouterr().err
    assert main([*arguments, "seed=1"]) == 1
    assert "0.csv was made with seed=0, not seed=1; run: " in capsys.readouterr().err


@pytest.mark.parametrize("setting", ["replicates=1", "replicates=x", "trails=3", "metrics=[TAS]"])
def test_wrong_settings_end_with_one_line(
    setting: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([f"results_dir={tmp_path}", setting]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert setting.partition("=")[0] in error
