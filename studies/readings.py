"""The captions' changes of the range of the PAS under readings that could give -59 % on a line.

The authors' program makes the last cameras outliers, draws one direction of the line, and computes
frames of collinear triangles from rounding errors; the number of hypotheses is varied. Each reading
has 24 independent studies. ``python -m studies.readings --output TABLE.csv TABLE.md``
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from experiments.command import run_command
from experiments.config import Selection, Sweep
from experiments.sweep import run_sweeps
from experiments.tables import to_csv, write_files
from figures.captions import CAPTIONS

from .settings import load_experiment
from .statistics import range_change

STUDIES = 24
LITERAL = ["tas.registration=literal_frames", "outliers=last", "geometry=x_axis", "frame=study"]
READINGS: Mapping[str, tuple[str, Sequence[str]]] = {  # by name: experiment and settings
    "line, as chosen here": ("maa_vs_pas_collinear", []),
    "line, literal frames, last cameras, one direction": ("maa_vs_pas_collinear", LITERAL),
    "line, the same, 100 hypotheses": ("maa_vs_pas_collinear", [*LITERAL, "tas.n_hypotheses=100"]),
    "line, the same, 50 hypotheses": ("maa_vs_pas_collinear", [*LITERAL, "tas.n_hypotheses=50"]),
    "line, the same, 30 hypotheses": ("maa_vs_pas_collinear", [*LITERAL, "tas.n_hypotheses=30"]),
    "cube, as chosen here": ("maa_vs_pas_outliers", []),
    "cube, last cameras, 100 hypotheses": (
        "maa_vs_pas_outliers",
        ["outliers=last", "tas.n_hypotheses=100"],
    ),
}
CELLS = [  # that the two captions of each experiment compare
    Selection(["PAS"], {"n_outliers": [0, 50]}),
    Selection(["PAS"], {"sigma_t": [0.01, 0.1]}),
]


def plan(settings: Sequence[str] = (), studies: int = STUDIES) -> dict[str, list[Sweep]]:
    """Return the sweeps of all studies of each reading."""
    plans = {}
    for name, (experiment, changes) in READINGS.items():
        sweep = load_experiment([f"experiment={experiment}", *changes, *settings])
        sweep = replace(sweep, metrics=["PAS"], selections=CELLS)
        plans[name] = [replace(sweep, replicate=number) for number in range(studies)]
    return plans


def answer(trials: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Compare each caption with the studies of each reading.

    Returns
    -------
    DataFrame
        One row for each `reading` and `comparison` of a caption: the change of the range of the PAS
        in per cent in the `paper`, and of the studies its `mean`, `sd`, `lowest` and `highest`.
    """
    rows = []
    for name, table in trials.items():
        for _, experiment, (comparison, setting, before, after), metrics in CAPTIONS:
            if experiment != table["experiment"].iloc[0]:
                continue
            levels: list[Mapping[str, Sequence[float]]] = [{setting: [before]}, {setting: [after]}]
            changes = pd.Series(
                [range_change(study, "PAS", *levels) for _, study in table.groupby("replicate")]
            )
            row = {"reading": name, "comparison": comparison, "paper": metrics["PAS"]}
            row |= {"mean": changes.mean(), "sd": changes.std()}
            row |= {"lowest": changes.min(), "highest": changes.max(), "studies": len(changes)}
            rows.append(row)
    return pd.DataFrame(rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all studies and write the table; return the exit code."""
    parser = ArgumentParser(prog="python -m studies.readings", description=__doc__.split("\n")[0])
    parser.add_argument("settings", nargs="*", metavar="key=value", help="as of experiments.run")
    parser.add_argument("--studies", type=int, default=STUDIES, help="of each reading")
    parser.add_argument("--n_jobs", type=int, default=1, help="processes")
    parser.add_argument("--output", nargs="+", type=Path, required=True, metavar="FILE")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    trials = {}
    for name, sweeps in plan(options.settings, options.studies).items():
        trials[name] = run_sweeps(sweeps, options.n_jobs)
    table = answer(trials)
    text = f"{table.to_markdown(index=False, floatfmt='.1f')}\n"
    return write_files(
        {path: text.encode() if path.suffix == ".md" else to_csv(table) for path in options.output}
    )


if __name__ == "__main__":
    sys.exit(main())
