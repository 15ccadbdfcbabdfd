"""A row for each metric and a column for each question: how often the metric is right."""

from collections.abc import Hashable, Mapping
from itertools import groupby
from typing import Any

import matplotlib
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from experiments.metrics import METRICS, Column
from figures import style

from ..order import SIGNIFICANCE
from .orders import is_new

CHANCE, CERTAIN = 50, 100
DARKEST = 0.93  # of the colours: the frame has to stand out
WHITE_ABOVE = 80  # the text
FRAME = "#ffb000"  # light, for it stands on dark cells
KINDS = {"new": "New scores", "paper": "The paper’s baselines", "today": "Today’s protocols"}
GAP = 0.35  # between questions and between kinds of metrics, in cells
CELL = (0.33, 0.152)  # inches
TIGHT = 5.5  # size of the type above narrow columns, in points


@style.applied()
def draw(table: pd.DataFrame) -> Figure:
    """Figure: protocols beside the new scores, and which puts two estimates in the right order."""
    columns = _places(table[["question", "asked"]].drop_duplicates().itertuples(index=False))
    metrics = [(_kind(metric), metric) for metric in table["metric"].unique()]
    metrics.sort(key=lambda metric: list(KINDS).index(metric[0]))
    rows = {metric: 1 + y for (_, metric), y in _places(metrics, title=1.0).items()}
    width, height = (1 + max(places.values()) for places in (columns, rows))
    figure = Figure(figsize=(1.42 + CELL[0] * width, 0.78 + CELL[1] * height), layout="constrained")
    axes = figure.subplots()
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    for row in table.to_dict("records"):
        _cell(axes, columns[row["question"], row["asked"]], rows[row["metric"]], row)
    asked = set(table[["question", "asked", "metric"]].itertuples(index=False, name=None))
    for key, x in columns.items():
        for metric, y in rows.items():
            if (*key, metric) not in asked:
                style.write(axes, x, y, "–", style.FAINT)
    _titles(axes, columns, {metric: (kind, rows[metric]) for kind, metric in metrics})
    figure.supxlabel(
        "The better of two estimates comes out better, % (50: chance).  × no better than chance   "
        "– not asked   framed: not certainly behind the best of the column",
        fontsize=style.SMALL,
        color=style.FAINT,
    )
    return figure


def _places(keys: Any, title: float = 0.0) -> dict[tuple[str, str], float]:
    """Return a place for each key, with a gap, and room for a title, before each new first part."""
    places: dict[tuple[str, str], float] = {}
    at = 0.0
    for _, group in groupby(keys, key=lambda key: key[0]):
        at += (GAP if places else 0.0) + (title if places else 0.0)
        for key in group:
            places[tuple(key)] = at
            at += 1
    return places


def _cell(axes: Axes, x: float, y: float, row: Mapping[Hashable, Any]) -> None:
    value = float(row["order"])
    blind = row["p_chance"] >= SIGNIFICANCE
    share = max(0.0, (value - CHANCE) / (CERTAIN - CHANCE))
    shade = matplotlib.colormaps[style.CELLS](0.08 + (DARKEST - 0.08) * share)
    colour = "0.965" if blind else shade
    axes.add_patch(Rectangle((x - 0.48, y - 0.47), 0.96, 0.94, facecolor=colour))
    if blind:
        style.write(axes, x, y, "×", style.INK)
        return
    if row["p_behind"] >= SIGNIFICANCE:
        box = Rectangle((x - 0.43, y - 0.4), 0.86, 0.8, fill=False, edgecolor=FRAME, linewidth=1.1)
        axes.add_patch(box)
    style.write(axes, x, y, f"{value:.0f}", "white" if value > WHITE_ABOVE else style.INK)


def _titles(
    axes: Axes, columns: Mapping[tuple[str, str], float], rows: Mapping[str, tuple[str, float]]
) -> None:
    """Name questions and what is asked in each, and metrics with their kinds."""
    axes.set_xticks(list(columns.values()), [asked.replace(" ", "\n", 1) for _, asked in columns])
    axes.set_yticks([y for _, y in rows.values()], [style.metric_name(metric) for metric in rows])
    for question, group in groupby(columns.items(), key=lambda item: item[0][0]):
        places = [x for _, x in group]
        place, title = ((places[0] + places[-1]) / 2, 1), question.replace("_", " ").capitalize()
        above: Any = {"xycoords": ("data", "axes fraction"), "ha": "center"}
        style.note(axes, title, place, (0, 21), fontweight="bold", **above)
    for kind, title in KINDS.items():
        places = [y for name, y in rows.values() if name == kind]
        if places:
            left: Any = {"xycoords": ("axes fraction", "data"), "ha": "right", "va": "center"}
            style.note(axes, title, (0, places[0] - 0.95), (-3, 0), fontweight="bold", **left)
    style.as_table(axes, TIGHT)


def _kind(metric: str) -> str:
    if is_new(metric):
        return "new"
    return "paper" if Column.parse(metric).metric.name in METRICS else "today"
