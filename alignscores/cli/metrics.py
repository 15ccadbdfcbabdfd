"""Metrics on the command line: their names, and their table."""

from collections.abc import Mapping

from ..comparison.tables import Cell, Table, as_text
from ..evaluation.settings import Settings
from ..metrics import FAMILIES, metric
from ..texts import shortened
from ..trajectories.formats import FORMATS, Format

__all__ = ["listing", "metre_notes", "metric_table"]

LONGEST = 40  # characters of a name
LEGEND = """\
K is a whole number of degrees, ANGLE is in degrees (5deg or 5), DISTANCE in mm, cm or m, as in
auc@30:vggt and recall@5cm,5deg:hloc. [brackets] may be left out; the default is the first choice.
STATISTIC: rmse, mean, median, std, min, max. ALIGNMENT: sim3, se3, scale, none.
PAIRS: consecutive, consecutive-reference, all, all-reference.
The definitions are in docs/reference/protocols.md."""


def listing() -> str:
    """Return all metrics and all formats, a line each."""
    metrics = [
        f"  {family.syntax:34} {family.description}{f' ({family.unit})' if family.unit else ''}"
        for family in FAMILIES
    ]
    formats = [f"  {name:9} {form.help}" for name, form in FORMATS.items()]
    return "\n".join(["metrics:", *metrics, "", LEGEND, "", "formats:", *formats])


def metre_notes(settings: Settings) -> list[str]:
    """Return a note on thresholds in metres where the reference has another unit."""
    names = [name for name in settings.metrics if metric(name).metres]
    if not names or settings.form.unit == "m":
        return []
    return [f"the reference's unit counts as a metre in {', '.join(names)}"]


def metric_table(
    rows: Mapping[str, Mapping[str, float | None]], settings: Settings, columns: int
) -> str:
    """Return the table of the metrics of estimates, in blocks of at most so many columns."""
    header = ["estimate", *(_heading(name, settings.form) for name in settings.metrics)]
    lines = [
        [Cell(shortened(name, LONGEST)), *(Cell(_cell(*value)) for value in row.items())]
        for name, row in rows.items()
    ]
    return as_text(Table(header, lines), columns)


def _heading(name: str, form: Format) -> str:
    """Return a metric with its unit, where it has one."""
    unit = metric(name).family.unit
    if "units" in unit:  # of the reference, which the table names where it has a name
        unit = form.unit if (unit, form.unit) == ("units", "m") else ""
    return f"{name} [{unit}]" if unit else name


def _cell(name: str, value: float | None) -> str:
    if value is None:
        return "-"
    unit = metric(name).family.unit
    return f"{value:.4f}" if not unit else f"{value:.2f}" if unit == "%" else f"{value:.4g}"
