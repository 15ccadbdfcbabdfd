"""The command ``alignscores metrics``: the names of all metrics."""

from ..metrics import FAMILIES

__all__ = ["listing"]

LEGEND = """\
K is a whole number of degrees, ANGLE is in degrees (5deg or 5), DISTANCE in mm, cm or m, as in
auc@30:vggt and recall@5cm,5deg:hloc. [brackets] may be left out; the default is the first choice.
STATISTIC: rmse, mean, median, std, min, max. ALIGNMENT: sim3, se3, scale, none.
PAIRS: consecutive, consecutive-reference, all, all-reference.
The definitions are in docs/reference/protocols.md."""


def listing() -> str:
    """Return all metrics, a line each."""
    metrics = [
        f"  {family.syntax:34} {family.description}{f' ({family.unit})' if family.unit else ''}"
        for family in FAMILIES
    ]
    return "\n".join([*metrics, "", LEGEND])
