"""Metrics on the command line: their names, what is wrong with them, and their table."""

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from ..evaluation.settings import Settings, options, order_problem
from ..metrics import FAMILIES, metric
from ..protocols import split_names
from ..texts import WIDTH, padded, text_width
from ..trajectories.formats import Format
from .table import shortened

__all__ = ["add_metrics", "alias_notes", "metre_notes", "metric_table"]

FIRST, LONGEST_NAME = "estimate", 40  # header of the names, and their characters
LEGEND = """\
K is a whole number of degrees, ANGLE is in degrees (5deg or 5), DISTANCE in mm, cm or m, as in
auc@30:vggt and recall@5cm,5deg:hloc. What is in [brackets] may be left out; the first choice then
holds. STATISTIC: rmse, mean, median, std, min, max. ALIGNMENT: sim3, se3, scale, none. PAIRS:
consecutive, consecutive-reference, all, all-reference. All are of the cameras that are scored, see
--missing. The definitions are in docs/reference/protocols.md."""


def add_metrics(group: Any, purpose: str, form: Format | None = None) -> None:
    """Add the option that takes them; `form` is None where the format is not known yet."""
    group.add_argument(
        "--metrics",
        metavar="NAMES",
        action=Metrics,
        form=form,
        default=(),
        help=f"{purpose}, {options()['metrics'].help}",
    )


class Metrics(argparse.Action):
    """Take a list of metrics; of ``help`` list all instead, and end.

    Those for which the format lacks something are refused, where it is known.
    """

    def __init__(self, form: Format | None = None, **options: Any) -> None:
        super().__init__(**options)
        self.form = form

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Take what follows the option."""
        if values == "help":
            print(listing())
            parser.exit()
        names = list(dict.fromkeys(split_names(values)))
        try:
            known = [metric(name).name for name in names]
        except ValueError as error:
            raise argparse.ArgumentError(self, f"{error}; --metrics help lists all") from None
        if self.form and (wrong := order_problem(known, self.form)):
            raise argparse.ArgumentError(self, wrong)
        setattr(namespace, self.dest, tuple(dict.fromkeys(known)))
        namespace.metrics_as_given = names


def listing() -> str:
    """Return all metrics, a line each."""
    lines = [
        f"{family.syntax:34} {family.description}{f' ({family.unit})' if family.unit else ''}"
        for family in FAMILIES
    ]
    return "\n".join([*lines, LEGEND])


def alias_notes(names: Sequence[str]) -> list[str]:
    """Say which names are old ones."""
    found = [metric(name) for name in names]
    return [
        f"{known.alias} is an old name, which will go: write {known.name}"
        for known in found
        if known.alias
    ]


def metre_notes(settings: Settings) -> list[str]:
    """Say which metrics are of thresholds in metres, where the reference's unit may be another."""
    taken = [name for name in settings.metrics if metric(name).metres]
    if not taken or settings.form.unit == "m":
        return []
    return [f"the reference's unit is taken for a metre in {', '.join(taken)}"]


def metric_table(
    rows: Mapping[str, Mapping[str, float | None]], settings: Settings, columns: int = WIDTH
) -> str:
    """Return the table of the metrics of estimates, in blocks of at most so many columns."""
    lines = []
    longest = min(max(map(text_width, [FIRST, *rows])), LONGEST_NAME)
    labels = shortened([FIRST, *rows], longest)
    block: list[list[str]] = []
    for name in settings.metrics:
        column = [heading(name, settings.form), *(cell(name, row[name]) for row in rows.values())]
        block.append([text.rjust(max(map(len, column))) for text in column])
        if longest + sum(2 + len(cells[0]) for cells in block) > columns and block[1:]:
            lines += [*_lines(labels, block[:-1]), ""]
            block = block[-1:]
    return "\n".join([*lines, *_lines(labels, block)])


def _lines(labels: Sequence[str], block: Sequence[Sequence[str]]) -> list[str]:
    width = max(map(text_width, labels))
    return [
        "  ".join([padded(label, width), *cells])
        for label, *cells in zip(labels, *block, strict=True)
    ]


def heading(name: str, form: Format) -> str:
    """Return a metric with its unit, where it has one."""
    unit = metric(name).family.unit
    if "units" in unit:  # of the reference, which the table names where it has a name
        unit = form.unit if (unit, form.unit) == ("units", "m") else ""
    return f"{name} [{unit}]" if unit else name


def cell(name: str, value: float | None) -> str:
    """Return a value as text."""
    if value is None:
        return "-"
    unit = metric(name).family.unit
    return f"{value:.4f}" if not unit else f"{value:.2f}" if unit == "%" else f"{value:.4g}"
