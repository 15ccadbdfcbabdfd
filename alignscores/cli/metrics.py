"""The command ``alignscores metrics``: the names of all metrics."""

from ..metrics import METRICS

__all__ = ["listing"]

LEGEND = """\
K is a whole number of degrees, ANGLE is in degrees (5deg or 5), DISTANCE in mm, cm or m, as in
auc@30:vggt and recall@5cm,5deg:hloc. [brackets] may be left out; the default is the first choice.
STATISTIC: rmse, mean, median, std, min, max (of rpg: mean, rmse, ...). ALIGNMENT: sim3, se3, scale,
none (of rpg: sim3, se3). PAIRS: consecutive, consecutive-reference, all, all-reference.
ERROR: translation, distance. ate:..., are and rpe need evo: pip install "alignscores[evo]".
The definitions are in docs/reference/metrics.md."""


def listing() -> str:
    """Return all metrics, a line each."""
    metrics = [
        f"  {entry.syntax:34} {entry.description}{f' ({entry.unit})' if entry.unit else ''}"
        for entry in METRICS
    ]
    return "\n".join([*metrics, "", LEGEND])
