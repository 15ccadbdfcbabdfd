"""Table 1 of the paper, derived from the trials by stated criteria."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from experiments.command import CommandError
from experiments.config import Execution, Sweep
from experiments.grid import cells
from experiments.metrics import evaluate
from experiments.sweep import draw_scene, run_sweeps, trial_seeds
from experiments.tables import TableError, Trials

from ..statistics import LEAST_POWER, dependence, power
from ..study import Question

OUTLIER_SHARE = 0.1  # robust: still discerns noise with so many of the cameras lost
SCALE = 1000.0  # metres to millimetres
SCALE_TOLERANCE = 0.01  # relative; a score may move by single counts through rounding
MOST_DEPENDENCE = 25.0  # insensitive: moves by less, in per cent of what the noise moves
# Other thresholds, and what the answers are by them.
OTHER_POWERS = (0.3, 0.7)
OTHER_SHARES = (0.3, 0.5)
OTHER_TOLERANCES = (0.001, 0.1)
OTHER_DEPENDENCES = (15.0, 35.0)

PAPER = {  # rows of table 1: scale unnecessary, outliers, collinearity, trajectory length
    "ATE": (False, False, True, True),
    "mAA": (True, True, False, False),
    "DTE": (True, True, True, False),
    "DRE": (True, True, True, False),
    "TAS": (True, True, True, True),
    "RAS": (True, True, True, True),
    "PAS": (True, True, True, True),
}
ROWS = {  # of metrics that share one: its yes is claimed of each, its no of one at least
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
    f"{OUTLIER_SHARE:.0%} of the cameras lost",
    f"Kendall tau with the noise level, positive where worse, at least {LEAST_POWER:g} on a line, "
    "without outliers",
    f"the mean moves over the numbers of cameras by less than {MOST_DEPENDENCE:g} % of its range "
    "over all noise levels too, mean over these",
)
NOTES = (
    f"The paper has one row for {ROWS['DTE']} and one for {ROWS['TAS']}. Its yes is claimed of "
    "each of them, its no of one at least.",
    "On a line the paper's yes for ATE and DTE holds without outliers alone: in its Figure 3, as "
    "here, a single one blinds both.",
    "How many cameras may be lost decides who is robust to outliers: see the other thresholds.",
)
OUTLIERS = {
    "ATE": "outliers",
    "mAA": "outliers",
    "DTE": "outliers",
    "TAS": "outliers",
    "DRE": "rotations",
    "RAS": "rotations",
    "PAS": "maa_vs_pas_outliers",
}
COLLINEAR = {
    "ATE": "collinear",
    "mAA": "collinear",
    "DTE": "collinear",
    "TAS": "collinear",
    "PAS": "maa_vs_pas_collinear",
}
LENGTH = {
    "ATE": "trajectory_length",
    "mAA": "trajectory_length",
    "DTE": "trajectory_length",
    "TAS": "trajectory_length",
    "PAS": "maa_vs_pas_length",
    "DRE": "maa_vs_pas_length",
    "RAS": "maa_vs_pas_length",
}
ADDED = ("DRE", "RAS")  # metrics that the paper's experiment on the length does not show
SCALE_EXPERIMENT = "combined"
EXPERIMENTS = tuple(
    dict.fromkeys([*OUTLIERS.values(), *COLLINEAR.values(), *LENGTH.values(), SCALE_EXPERIMENT])
)


@dataclass(frozen=True)
class Finding:
    """Whether a metric has a property, what tells so, and the answers by other thresholds."""

    holds: bool
    value: float
    statistic: str
    experiment: str
    others: Mapping[str, bool]


def ask(question: Question) -> list[pd.DataFrame | str]:
    """Return Table 1 as a table and in words."""
    table = compare({trials.sweep.name: trials for trials in question.trials})
    return [table, to_markdown(table)]


def compare(experiments: Mapping[str, Trials]) -> pd.DataFrame:
    """Derive Table 1 from the trials of `EXPERIMENTS`.

    Returns
    -------
    DataFrame
        One row for each `metric` and `property`, with the `row` of the paper's table: the answers
        of the `paper` and `ours`, whether it `agrees` (with a no, where one metric of the row has
        it), the `statistic` with its `value`, the `criterion`, the `experiment` and
        `sensitivity`: our answers by other thresholds. Where nothing could tell, `ours` is "not
        tested".
    """
    missing = [name for name in EXPERIMENTS if name not in experiments]
    if missing:
        raise CommandError(f"Table 1 needs the trials of {', '.join(missing)}, too")
    trials = {name: _checked(experiments[name]) for name in EXPERIMENTS if name != SCALE_EXPERIMENT}
    lengths = {metric: trials[name] for metric, name in LENGTH.items()}
    lengths |= dict.fromkeys(ADDED, _run_added(experiments[LENGTH[ADDED[0]]].sweep))
    scale_changes = _scale_changes(experiments[SCALE_EXPERIMENT].sweep)
    rows = []
    for metric, answers in PAPER.items():
        findings = (
            _scale(scale_changes[metric]),
            _outliers(trials[OUTLIERS[metric]], metric),
            _collinear(trials[COLLINEAR[metric]], metric) if metric in COLLINEAR else None,
            _length(lengths[metric], metric),
        )
        for name, criterion, paper, finding in zip(
            PROPERTIES, CRITERIA, answers, findings, strict=True
        ):
            row: dict[str, str | float] = {"row": ROWS.get(metric, metric), "metric": metric}
            row |= {"property": name, "paper": _yes(paper), "ours": "not tested"}
            if finding is not None:
                row |= {
                    "ours": _yes(finding.holds),
                    "statistic": finding.statistic,
                    "value": round(finding.value, 4),
                    "experiment": finding.experiment,
                    "sensitivity": ", ".join(
                        f"{threshold}: {_yes(holds)}" for threshold, holds in finding.others.items()
                    ),
                }
            rows.append(row | {"criterion": criterion})
    columns = ["row", "metric", "property", "paper", "ours", "agrees", "statistic", "value"]
    table = pd.DataFrame(rows, columns=[*columns, "criterion", "experiment", "sensitivity"])
    tested = table[table["ours"] != "not tested"]
    joint = agreements(tested, tested["ours"])
    of_row = joint.loc[pd.MultiIndex.from_frame(tested[["row", "property"]])].to_numpy()
    agrees = np.where(tested["paper"] == "yes", tested["ours"] == "yes", of_row)
    table["agrees"] = pd.Series(agrees, tested.index).map({True: "yes", False: "no"})
    return table


def agreements(tested: pd.DataFrame, answers: "pd.Series[str]") -> "pd.Series[bool]":
    """Tell by row and property of the paper's table whether the answers bear it out.

    A yes is borne out where all metrics of the row have the property, a no where one has not.
    """
    cells = tested.assign(all=answers == "yes", paper=tested["paper"] == "yes")
    found = cells.groupby(["row", "property"], sort=False)[["all", "paper"]].all()
    return found["all"] == found["paper"]


def sensitivity(table: pd.DataFrame) -> dict[str, tuple[int, list[str]]]:
    """Tell how many cells agree with the paper by each other threshold, and which change."""
    tested = table[table["ours"] != "not tested"]
    others = [dict(text.split(": ") for text in cell.split(", ")) for cell in tested["sensitivity"]]
    found = {}
    for threshold in dict.fromkeys(threshold for cell in others for threshold in cell):
        pairs = zip(others, tested["ours"], strict=True)
        answers = pd.Series([cell.get(threshold, ours) for cell, ours in pairs], tested.index)
        changed = tested[answers != tested["ours"]]
        cells = [f"{row['metric']} ({row['property']})" for _, row in changed.iterrows()]
        found[threshold] = int(agreements(tested, answers).sum()), cells
    return found


def to_markdown(table: pd.DataFrame) -> str:
    """Write the table as the paper has it, with the numbers that decide."""
    lines = [f"| | {' | '.join(PROPERTIES)} |", f"|---{'|---' * len(PROPERTIES)}|"]
    for metric, rows in table.groupby("metric", sort=False):
        marks = [_mark(row) for _, row in rows.iterrows()]
        lines.append(f"| {metric} | {' | '.join(marks)} |")
    tested = table[table["ours"] != "not tested"]
    agreeing = agreements(tested, tested["ours"])
    lines += [
        "",
        f"{agreeing.sum()} of {len(agreeing)} cells of the paper's Table 1 are borne out; "
        "**bold**: what is not. In brackets what decides. –: positions play no part in it.",
        "",
        *(f"- *{name}*: {text}" for name, text in zip(PROPERTIES, CRITERIA, strict=True)),
        "",
        *(f"{note}\n" for note in NOTES),
        "| another threshold | cells that agree | other answers |",
        "|---|---|---|",
        *(
            f"| {threshold} | {agree} of {len(agreeing)} | {', '.join(cells) or 'none'} |"
            for threshold, (agree, cells) in sensitivity(table).items()
        ),
    ]
    return "\n".join(lines) + "\n"


def _mark(row: "pd.Series[str]") -> str:
    if row["ours"] == "not tested":
        return "–"
    answer = "✓" if row["ours"] == "yes" else "✗"
    answer = answer if row["agrees"] == "yes" else f"**{answer}**"
    return f"{answer} ({row['value']:.3g})"


def _scale_changes(sweep: Sweep) -> dict[str, float]:
    """Largest relative change of each metric, over one trial a cell, in scaled ground truth."""
    changes = dict.fromkeys(PAPER, 0.0)
    for cell in cells(sweep):
        scene_seed, registration_seed = trial_seeds(sweep, cell, 0)
        scene = draw_scene(sweep, cell, scene_seed)
        scaled = replace(scene, gt_positions=SCALE * scene.gt_positions)
        before = evaluate(scene, list(PAPER), registration_seed)
        after = evaluate(scaled, list(PAPER), registration_seed)
        for metric, value in before.items():
            change = abs(after[metric] - value)
            changes[metric] = max(changes[metric], change / abs(value) if change else 0.0)
    return changes


def _run_added(sweep: Sweep) -> pd.DataFrame:
    """Evaluate rotation metrics on the trials of an experiment that does not show them."""
    execution = Execution(n_jobs=1, backend="sequential", dask_address=None, results_dir="unused")
    return run_sweeps([replace(sweep, metrics=list(ADDED))], execution)


def _scale(change: float) -> Finding:
    others = {f"within {other:g}": change <= other for other in OTHER_TOLERANCES}
    holds = change <= SCALE_TOLERANCE
    return Finding(holds, change, "largest relative change", SCALE_EXPERIMENT, others)


def _outliers(trials: pd.DataFrame, metric: str) -> Finding:
    n_cameras = trials["n_cameras"].min()

    def weakest(share: float) -> float:
        few = trials[trials["n_outliers"].between(1, share * n_cameras)]
        return power(few, metric, _noise(trials), "smallest")

    value = weakest(OUTLIER_SHARE)
    others = {f"{share:.0%} lost": weakest(share) >= LEAST_POWER for share in OTHER_SHARES}
    statistic = f"smallest tau with 1 to {OUTLIER_SHARE:.0%} outliers"
    return _discerns(value, statistic, _name(trials), others)


def _collinear(trials: pd.DataFrame, metric: str) -> Finding:
    none = trials[trials["n_outliers"] == 0]
    value = power(none, metric, _noise(trials), "smallest")
    return _discerns(value, "tau without outliers", _name(trials), {})


def _discerns(tau: float, statistic: str, experiment: str, others: Mapping[str, bool]) -> Finding:
    powers = {f"tau {least:g}": tau >= least for least in OTHER_POWERS}
    return Finding(tau >= LEAST_POWER, tau, statistic, experiment, {**others, **powers})


def _length(trials: pd.DataFrame, metric: str) -> Finding:
    moves = dependence(trials, metric, ["n_cameras"], "mean")
    others = {f"less than {other:g} %": moves < other for other in OTHER_DEPENDENCES}
    return Finding(moves < MOST_DEPENDENCE, moves, "movement of the mean, %", _name(trials), others)


def _noise(trials: pd.DataFrame) -> list[str]:
    return ["sigma_t" if trials["sigma_t"].nunique() > 1 else "sigma_r_deg"]


def _name(trials: pd.DataFrame) -> str:
    return str(trials["experiment"].iloc[0])


def _yes(answer: bool) -> str:
    return "yes" if answer else "no"


def _checked(experiment: Trials) -> pd.DataFrame:
    """Return a table that the criteria can be applied to."""
    path, trials, name = experiment.path, experiment.table, experiment.sweep.name
    for metric, tested in [*OUTLIERS.items(), *COLLINEAR.items(), *LENGTH.items()]:
        if tested == name and metric not in (*trials, *(ADDED if name in LENGTH.values() else ())):
            raise TableError(path, f"has no column {metric}")
    noise = trials["sigma_t"].nunique() * trials["sigma_r_deg"].nunique()
    if noise < 2:
        raise TableError(path, "has one noise level, which nothing can be correlated with")
    if name in LENGTH.values():
        if trials["n_cameras"].nunique() < 2:
            raise TableError(path, "has one number of cameras")
    elif not trials["n_outliers"].between(1, OUTLIER_SHARE * trials["n_cameras"].min()).any():
        raise TableError(path, f"has no trials with 1 to {OUTLIER_SHARE:.0%} outliers")
    elif name in COLLINEAR.values() and not (trials["n_outliers"] == 0).any():
        raise TableError(path, "has no trials without outliers")
    return trials
