"""Metrics by name: the scores of this package, and today's protocols beside them."""

import argparse
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from ..protocols import PROTOCOLS, protocol, split_names
from ..trajectories.association import Matches
from ..trajectories.formats import Format
from .names import columns, padded
from .table import WIDTH, shortened

if TYPE_CHECKING:
    from .scoring import Scored

__all__ = ["OWN", "Metrics", "metre_notes", "metric_table", "metric_values"]
__all__ += ["order_problem", "protocol_values"]


@dataclass(frozen=True)
class Own:
    """A metric that every estimate has anyway: what it is, its unit, and where it stands."""

    description: str
    unit: str
    value: "Callable[[Scored], float | None]"


OWN: Mapping[str, Own] = {
    "tas": Own("Translation Alignment Score, mean over the seeds", "", lambda one: one.tas),
    "ras": Own("Rotation Alignment Score", "", lambda one: one.result.ras.score),
    "pas": Own("Pose Alignment Score, mean over the seeds", "", lambda one: one.pas),
    "half": Own("half-score distance", "units", lambda one: one.half_distance),
    "half:rotation": Own("half-score angle", "deg", lambda one: one.half_angle),
    "ate": Own("RMSE of the positions, aligned by least squares", "units", lambda one: one.ate),
}
FIRST, MOST = "estimate", 40  # the header of the names, and their characters in a table of metrics
LENGTHS = {"distance", "length", "max_error", "accuracy"}  # arguments that are lengths in metres
IN_METRES = {"maa", "kitti"}  # heads of names whose lengths are fixed
LEGEND = """\
K is a whole number of degrees, ANGLE is in degrees (5deg or 5), DISTANCE in mm, cm or m, as in
auc@30:vggt and recall@5cm,5deg. What is in [brackets] may be left out; the first choice then holds.
STATISTIC: rmse, mean, median, std, min, max. ALIGNMENT: sim3, se3, scale, none. PATH: estimate,
reference, consecutive. All are of the cameras that are scored, see --missing. The
definitions are in docs/reference/protocols.md."""


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
        names = list(dict.fromkeys(name.lower() for name in split_names(values)))
        for name in names:
            if wrong := self._wrong(name):
                raise argparse.ArgumentError(self, wrong)
        setattr(namespace, self.dest, names)

    def _wrong(self, name: str) -> str:
        """Say what is wrong with a name, if anything is."""
        if name in OWN:
            return ""
        try:
            found = protocol(name)
        except ValueError as error:
            own = get_close_matches(name, OWN, n=2)
            message = f"unknown metric {name!r}; close to it are {', '.join(own)}" if own else error
            return f"{message}; --metrics help lists all"
        return order_problem([found.name], self.form) if self.form else ""


def order_problem(names: Sequence[str], form: Format) -> str:
    """Say which metric needs an order of the cameras that the format lacks, if one does."""
    for name in names:
        if name not in OWN and protocol(name).family.ordered and not form.ordered:
            return f"{name} needs cameras in the order of time, but images are matched by name"
    return ""


def listing() -> str:
    """Return all metrics, a line each."""
    lines = [(name, own.description, own.unit) for name, own in OWN.items()]
    lines += [(family.syntax, family.description, family.unit) for family in PROTOCOLS]
    listed = [
        f"{name:34} {description}{f' ({unit})' if unit else ''}"
        for name, description, unit in lines
    ]
    return "\n".join([*listed, LEGEND])


def protocol_values(
    matches: Matches, names: Sequence[str], *, seed: int, n_parts: int
) -> tuple[dict[str, float], list[str]]:
    """Evaluate the protocols among the names; return those with a value, and why others have none.

    They are of the poses as they were scored. Those of an estimate in parts are of no single world.
    """
    protocols = [name for name in names if name not in OWN]
    if n_parts > 1 and protocols:
        return {}, [f"no value of {', '.join(protocols)}: they need one world, not {n_parts} parts"]
    found, notes = {}, []
    for name in protocols:
        gt, est = matches.gt_poses, matches.est_poses
        try:
            value = protocol(name)(
                gt[:, :3, 3], gt[:, :3, :3], est[:, :3, 3], est[:, :3, :3], rng=seed
            )
        except ValueError as error:
            notes.append(f"no value of {name}: {error}")
            continue
        if math.isfinite(value):
            found[name] = value
        else:
            notes.append(f"no value of {name}: it is not finite, with so many cameras lost")
    return found, notes


def metric_values(one: "Scored", names: Sequence[str]) -> dict[str, float | None]:
    """Return the metrics of an estimate by their names; None where there is no value."""
    found = {
        name: OWN[name].value(one) if name in OWN else one.protocols.get(name) for name in names
    }
    return {
        name: None if value is None or math.isinf(value) else value for name, value in found.items()
    }


def metre_notes(names: Sequence[str], form: Format) -> list[str]:
    """Say which metrics are of thresholds in metres, where the reference's unit may be another."""
    taken = [
        name
        for name in names
        if name not in OWN
        and (LENGTHS & protocol(name).arguments.keys() or head(name) in IN_METRES)
    ]
    if not taken or form.unit == "m":
        return []
    return [f"the reference's unit is taken for a metre in {', '.join(taken)}"]


def metric_table(
    rows: Mapping[str, Mapping[str, float | None]], names: Sequence[str], form: Format
) -> str:
    """Return the table of the metrics of estimates, in blocks of at most 100 columns."""
    lines = []
    longest = min(max(map(columns, [FIRST, *rows])), MOST)
    labels = shortened([FIRST, *rows], longest)
    block: list[list[str]] = []
    for name in names:
        column = [heading(name, form), *(cell(name, row[name]) for row in rows.values())]
        block.append([text.rjust(max(map(len, column))) for text in column])
        if longest + sum(2 + len(one[0]) for one in block) > WIDTH and block[1:]:
            lines += [*_lines(labels, block[:-1]), ""]
            block = block[-1:]
    return "\n".join([*lines, *_lines(labels, block)])


def _lines(labels: Sequence[str], block: Sequence[Sequence[str]]) -> list[str]:
    width = max(map(columns, labels))
    return [
        "  ".join([padded(label, width), *cells])
        for label, *cells in zip(labels, *block, strict=True)
    ]


def heading(name: str, form: Format) -> str:
    """Return a metric with its unit, where it has one."""
    unit = OWN[name].unit if name in OWN else protocol(name).family.unit
    if "units" in unit:  # of the reference, which the table names where it has a name
        unit = form.unit if (unit, form.unit) == ("units", "m") else ""
    return f"{name} [{unit}]" if unit else name


def head(name: str) -> str:
    """Return what stands before numbers and words."""
    return name.partition("@")[0].partition(":")[0]


def cell(name: str, value: float | None) -> str:
    """Return a value as text."""
    if value is None:
        return "-"
    if name in OWN:
        return f"{value:.4f}" if not OWN[name].unit else f"{value:.4g}"
    unit = protocol(name).family.unit
    return f"{value:.4f}" if not unit else f"{value:.2f}" if unit == "%" else f"{value:.4g}"
