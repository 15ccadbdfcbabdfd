"""Table 1 of the paper, derived from the trials by stated criteria."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from experiments.config import Sweep
from experiments.grid import cells
from experiments.metrics import evaluate_scenes
from experiments.sweep import draw_scene, run_sweeps, trial_seeds
from experiments.tables import TableError, Trials

from .statistics import LEAST_POWER, dependence, power

OUTLIER_SHARE = 0.1  # robust: still discerns noise with so many outliers
SCALE = 1000.0  # metres to millimetres
SCALE_TOLERANCE = 0.01  # relative; a score may move by single counts through rounding
MOST_DEPENDENCE = 25.0  # insensitive: moves by less, in per cent of what the noise moves

PAPER = {  # rows of table 1: scale unnecessary, outliers, collinearity, trajectory length
    "ATE": (False, False, True, True),
    "mAA": (True, True, False, False),
    "DTE": (True, True, True, False),
    "DRE": (True, True, True, False),
    "TAS": (True, True, True, True),
    "RAS": (True, True, True, True),
    "PAS": (True, True, True, True),
}
ROWS = {  # shared by metrics: a yes is claimed of each, a no of at least one
    **dict.fromkeys(("DTE", "DRE"), "DTE & DRE"),
    **dict.fromkeys(("TAS", "RAS", "PAS"), "TAS, RAS & PAS"),
}
PROPERTIES = (
    "metric scale unnecessary",
    "robust to outliers",
    "robust to collinearity",
    "insensitive to trajectory length",
)
CRITERIA = (
    f"value unchanged (within {SCALE_TOLERANCE:.0%}) when the ground truth is scaled by {SCALE:g}",
    f"Kendall tau with the noise level, positive where worse, at least {LEAST_POWER:g} with up to "
    f"{OUTLIER_SHARE:.0%} outliers",
    f"Kendall tau with the noise level, positive where worse, at least {LEAST_POWER:g} on a line, "
    "without outliers",
    f"the mean moves over the numbers of cameras by less than {MOST_DEPENDENCE:g} % of its range "
    "over all noise levels too, mean over these",
)
NOTES = (
    f"The paper has one row for {ROWS['DTE']} and one for {ROWS['TAS']}. A yes is claimed of "
    "each metric, a no of at least one.",
    "On a line the paper's yes for ATE and DTE holds only without outliers: in its Figure 3, as "
    "here, a single one makes both flat.",
)
CAPTION = (
    "The paper's four rows, then each metric. **Bold**: not as in the paper's Table 1. In brackets "
    "what decides; in a row of several metrics, of the one that decides its answer. –: positions "
    "play no part in it."
)
SCALE_EXPERIMENT = "combined"
ADDED = ("DRE", "RAS")  # metrics that the paper's experiment on the length does not show
LENGTHS = ("trajectory_length", "maa_vs_pas_length")
EXPERIMENTS_OF = {  # the experiments on outliers, on a line and on the length; none: not tested
    **dict.fromkeys(("ATE", "mAA", "DTE", "TAS"), ("outliers", "collinear", LENGTHS[0])),
    **dict.fromkeys(ADDED, ("rotations", None, LENGTHS[1])),
    "PAS": ("maa_vs_pas_outliers", "maa_vs_pas_collinear", LENGTHS[1]),
}

Finding = dict[str, str | float]  # whether a metric has a property, as columns of the table


def answer(trials: Sequence[Trials]) -> list[pd.DataFrame | str]:
    """Return Table 1 as data and in Markdown."""
    compared = compare({table.sweep.name: table for table in trials})
    return [compared, to_markdown(compared)]


def compare(experiments: Mapping[str, Trials]) -> pd.DataFrame:
    """Derive Table 1 from the trials of the paper's experiments.

    Returns
    -------
    DataFrame
        One row for each `metric` and `property`, with the `row` of the paper's table: the answers
        of the `paper` and `ours`, whether it `agrees` (with a no, where one metric of the row has
        it), the `statistic` with its `value`, the `criterion` and the `experiment`. Where nothing
        could tell, `ours` is "not tested".
    """
    trials = {
        name: _checked(experiment)
        for name, experiment in experiments.items()
        if name != SCALE_EXPERIMENT
    }
    added = _run_added(experiments[LENGTHS[1]].sweep)
    scale_changes = _scale_changes(experiments[SCALE_EXPERIMENT].sweep)
    rows = []
    for metric, answers in PAPER.items():
        outliers, line, length = EXPERIMENTS_OF[metric]
        tested_in = SCALE_EXPERIMENT, outliers, line, length
        findings = (
            _scale(scale_changes[metric]),
            _outliers(trials[outliers], metric),
            _collinear(trials[line], metric) if line else {},
            _length(added if metric in ADDED else trials[length], metric),
        )
        row: dict[str, object] = {"row": ROWS.get(metric, metric), "metric": metric}
        row["ours"] = "not tested"
        entries = zip(PROPERTIES, CRITERIA, answers, tested_in, findings, strict=True)
        rows += [
            row
            | {"property": name, "criterion": criterion, "paper": _yes(paper)}
            | {"experiment": experiment, **finding}
            for name, criterion, paper, experiment, finding in entries
        ]
    columns = ["row", "metric", "property", "paper", "ours", "agrees", "statistic", "value"]
    table = pd.DataFrame(rows, columns=[*columns, "criterion", "experiment"])
    tested = table[table["ours"] != "not tested"]
    joint = agreements(tested, tested["ours"])
    of_row = joint.loc[pd.MultiIndex.from_frame(tested[["row", "property"]])].to_numpy()
    agrees = np.where(tested["paper"] == "yes", tested["ours"] == "yes", of_row)
    table["agrees"] = pd.Series(agrees, tested.index).map({True: "yes", False: "no"})
    return table


def agreements(tested: pd.DataFrame, answers: "pd.Series[str]") -> "pd.Series[bool]":
    """Return by row and property of the paper's table whether answers agree; see `NOTES`."""
    cells = tested.assign(all=answers == "yes", paper=tested["paper"] == "yes")
    agreed = cells.groupby(["row", "property"], sort=False)[["all", "paper"]].all()
    return agreed["all"] == agreed["paper"]


def to_markdown(table: pd.DataFrame) -> str:
    """Write the table as the paper has it, with the numbers that decide."""
    lines = ["| |" + "|".join(PROPERTIES) + "|", "|---" * (1 + len(PROPERTIES)) + "|"]
    for row, cells_of_row in table.groupby("row", sort=False):
        deciding = [
            _deciding(cells_of_row[cells_of_row["property"] == name]) for name in PROPERTIES
        ]
        lines.append(f"| {row} | " + " | ".join(map(_mark, deciding)) + " |")
    lines.append("| *each metric* |" + " |" * len(PROPERTIES))
    for metric, rows in table.groupby("metric", sort=False):
        lines.append(f"| {metric} | " + " | ".join(_mark(row) for _, row in rows.iterrows()) + " |")
    criteria = [f"- *{name}*: {text}" for name, text in zip(PROPERTIES, CRITERIA, strict=True)]
    return "\n\n".join(["\n".join(lines), CAPTION, "\n".join(criteria), *NOTES]) + "\n"


def _mark(row: "pd.Series[str]") -> str:
    if row["ours"] == "not tested":
        return "–"
    answer = "✓" if row["ours"] == "yes" else "✗"
    answer = answer if row["agrees"] == "yes" else f"**{answer}**"
    if row["property"] == PROPERTIES[0]:
        return f"{answer} ({100 * row['value']:+.0f} %)"
    if row["property"] == PROPERTIES[-1]:
        return f"{answer} ({row['value']:.0f} %)"
    return f"{answer} (τ {row['value']:+.2f})"


def _deciding(cells_of_row: pd.DataFrame) -> "pd.Series[str]":
    """Return the metric that decides a cell of the paper's table: the one that has it least."""
    tested = cells_of_row[cells_of_row["ours"] != "not tested"]
    values = tested["value"].astype(float)
    is_tau = tested["property"].iloc[0] in PROPERTIES[1:3]
    deciding: pd.Series[str] = tested.iloc[int((values if is_tau else -values).argmin())].copy()
    deciding["agrees"] = "yes" if deciding["ours"] == deciding["paper"] else "no"
    return deciding


def _scale_changes(sweep: Sweep) -> dict[str, float]:
    """Largest relative change of each metric, over one trial a cell, in scaled ground truth."""
    grid = cells(sweep)
    scene_seeds, seeds = zip(*(trial_seeds(sweep, cell, 0) for cell in grid), strict=True)
    scenes = [draw_scene(sweep, *drawn) for drawn in zip(grid, scene_seeds, strict=True)]
    scaled = [replace(scene, gt_positions=SCALE * scene.gt_positions) for scene in scenes]
    before, after = (evaluate_scenes(variant, seeds, list(PAPER)) for variant in (scenes, scaled))
    changes = {metric: np.abs(after[metric] - values) for metric, values in before.items()}
    for metric, change in changes.items():
        np.divide(change, np.abs(before[metric]), out=change, where=change > 0)
    return {metric: float(change.max()) for metric, change in changes.items()}


def _run_added(sweep: Sweep) -> pd.DataFrame:
    """Evaluate rotation metrics on the trials of an experiment that does not show them."""
    return run_sweeps([replace(sweep, metrics=list(ADDED))])


def _scale(change: float) -> Finding:
    return _finding(change <= SCALE_TOLERANCE, change, "largest relative change")


def _outliers(trials: pd.DataFrame, metric: str) -> Finding:
    with_outliers = trials[
        trials["n_outliers"].between(1, OUTLIER_SHARE * trials["n_cameras"].min())
    ]
    tau = power(with_outliers, metric, _noise(trials), "smallest")
    return _finding(tau >= LEAST_POWER, tau, f"smallest tau with 1 to {OUTLIER_SHARE:.0%} outliers")


def _collinear(trials: pd.DataFrame, metric: str) -> Finding:
    none = trials[trials["n_outliers"] == 0]
    tau = power(none, metric, _noise(trials), "smallest")
    return _finding(tau >= LEAST_POWER, tau, "tau without outliers")


def _length(trials: pd.DataFrame, metric: str) -> Finding:
    moves = dependence(trials, metric, ["n_cameras"], "mean")
    return _finding(moves < MOST_DEPENDENCE, moves, "movement of the mean, %")


def _finding(holds: bool, value: float, statistic: str) -> Finding:
    return {"ours": _yes(holds), "statistic": statistic, "value": value}


def _noise(trials: pd.DataFrame) -> list[str]:
    return ["sigma_t" if trials["sigma_t"].nunique() > 1 else "sigma_r_deg"]


def _yes(answer: bool) -> str:
    return "yes" if answer else "no"


def _checked(experiment: Trials) -> pd.DataFrame:
    """Return a table that the criteria can be applied to."""
    path, trials, name = experiment.path, experiment.table, experiment.sweep.name
    noise = trials["sigma_t"].nunique() * trials["sigma_r_deg"].nunique()
    if noise < 2:
        raise TableError(path, "has only one noise level: nothing can be correlated with it")
    if name in LENGTHS:
        if trials["n_cameras"].nunique() < 2:
            raise TableError(path, "has one number of cameras")
    elif not trials["n_outliers"].between(1, OUTLIER_SHARE * trials["n_cameras"].min()).any():
        raise TableError(path, f"has no trials with 1 to {OUTLIER_SHARE:.0%} outliers")
    elif "collinear" in name and not (trials["n_outliers"] == 0).any():
        raise TableError(path, "has no trials without outliers")
    return trials
