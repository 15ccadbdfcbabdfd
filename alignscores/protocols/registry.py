"""The names of the protocols: what each means, and what it is called with.

A name is a head, mostly with numbers, and words behind colons in any order: ``auc@30:vggt``,
``recall@5cm,5deg``, ``rpe@1m:rotation:reference``. This module alone reads them.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..averaging import nearest_rotations
from ..translation import Seed
from ..validation import check_positions, check_rotations, check_same_length
from .colmap import (
    colmap_absolute_auc,
    colmap_absolute_recall,
    colmap_relative_auc,
    colmap_relative_recall,
)
from .images import ace0_recall, hloc_median, hloc_recall
from .imc import IMC_2024, imc_maa
from .relative import vggt_auc, vggt_rra, vggt_rta
from .segments import kitti_relative_error, rpg_relative_error
from .trajectory import STATISTICS, evo_are, evo_ate, evo_rpe, mapanything_ate

__all__ = ["PROTOCOLS", "Family", "Protocol", "protocol", "split_names"]

NUMBER = r"\d+(?:\.\d+)?|\.\d+"
WHOLE = r"@(?P<k>\d+)(?:deg)?"
ANGLE = rf"(?P<max_error_deg>{NUMBER})(?:deg)?"
UNITS = {"mm": 1000, "cm": 100, "m": 1}  # in a metre, which is a unit of the ground truth
UNIT = rf"(?P<unit>{'|'.join(UNITS)})"
ERROR = rf"(?P<max_error>{NUMBER}){UNIT}"
LENGTHS = "distance", "length", "max_error"  # arguments in units of the ground truth

CONVENTION = {"convention": {name: name for name in ("vggt", "mapanything", "da3")}}
ACCURACY = {"accuracy": {"colmap": 0.001, "colmap-imc": 0.02}}
HLOC = {"alignment": {"hloc": "none", "hloc-sim3": "sim3"}}
STATISTIC = {name: name for name in STATISTICS if name != "sse"}
ALIGNED = {
    "alignment": {name: name for name in ("sim3", "se3", "scale", "none")},
    "statistic": STATISTIC,
}
PAIRS = {"pairs": {name: name for name in ("estimate", "reference", "consecutive")}}
SCALED = {
    "alignment": {name: name for name in ("sim3", "se3")},
    "statistic": {"mean": "mean"} | STATISTIC,
}
ROTATION = {"error": {"rotation": "rotation"}}

Words = Mapping[str, Any]


@dataclass(frozen=True)
class Family:
    """Names that are read alike and differ in numbers and words.

    Parameters
    ----------
    syntax : str
        The names, as a list of them shows it.
    example : str
        One of them.
    description : str
        What the value is, in a line.
    function : callable
        Of poses, or of positions where no rotations are needed, and of what the name sets.
    head : str
        Regular expression of what stands before the first colon. Its groups set the arguments.
    missing : {"fail", "left out", "refused"}
        What happens to cameras without an estimate.
    origin : str
        A word that the names have to have, if any.
    required : mapping of str to mapping
        Arguments that one of the words has to set, each with its words and their values.
    optional : mapping of str to mapping
        Arguments that one of the words may set; the first word is what holds without.
    unit : str
        "%", "deg", "deg/unit", "units" (of the ground truth; "estimated units") or none.
    larger_is_better : bool
        Whether it is a score; an error otherwise.
    rotations : bool
        Whether it looks at the rotations of the cameras.
    ordered : bool
        Whether the cameras have to stand in the order of time.
    random : bool
        Whether the value depends on the seed.

    Examples
    --------
    >>> from alignscores.protocols import protocol
    >>> family = protocol("recall@5cm,5deg").family
    >>> family.unit, family.larger_is_better, family.missing, family.random
    ('%', True, 'fail', True)
    """

    syntax: str
    example: str
    description: str
    function: Callable[..., float]
    head: str
    missing: Literal["fail", "left out", "refused"]
    origin: str = ""
    required: Mapping[str, Words] = field(default_factory=dict)
    optional: Mapping[str, Words] = field(default_factory=dict)
    unit: str = ""
    larger_is_better: bool = False
    rotations: bool = True
    ordered: bool = False
    random: bool = False

    def arguments(self, name: str) -> dict[str, Any] | None:
        """Return what a name sets.

        Parameters
        ----------
        name : str
            As users write it, in lower case.

        Returns
        -------
        dict or None
            Arguments of the family's function; None where it is no name of the family.

        Examples
        --------
        >>> from alignscores.protocols import protocol
        >>> family = protocol("rpe@1m").family
        >>> family.arguments("rpe@2m:mean")["distance"], family.arguments("ate")
        (2.0, None)
        """
        head, *words = name.split(":")
        match = re.fullmatch(self.head, head)
        if match is None or (self.origin and self.origin not in words):
            return None
        chosen: dict[str, Any] = {}
        for word in words:
            if word == self.origin:
                continue
            choices = {**self.required, **self.optional}
            key = next((key for key, choice in choices.items() if word in choice), None)
            if key is None or key in chosen:
                return None
            chosen[key] = choices[key][word]
        numbers = _numbers(match)
        if not self.required.keys() <= chosen.keys() or 0 in numbers.values():
            return None
        defaults = {key: next(iter(choice.values())) for key, choice in self.optional.items()}
        return {**defaults, **chosen, **numbers}


@dataclass(frozen=True)
class Protocol:
    """One metric by its name; call it with cameras.

    Parameters
    ----------
    name : str
        As it was given, in lower case.
    family : Family
        What is known about it: unit, direction, what it needs, what missing cameras do.
    arguments : mapping of str to object
        What the name says, as arguments of the family's function.

    Examples
    --------
    >>> from alignscores.protocols import protocol
    >>> metric = protocol("AUC@30:vggt")
    >>> metric.name, metric.family.unit
    ('auc@30:vggt', '%')
    """

    name: str
    family: Family
    arguments: Mapping[str, Any]

    def __call__(
        self,
        gt_positions: ArrayLike,
        gt_rotations: ArrayLike | None,
        est_positions: ArrayLike,
        est_rotations: ArrayLike | None,
        *,
        rng: Seed = 0,
    ) -> float:
        """Evaluate the metric.

        Parameters
        ----------
        gt_positions, est_positions : (n, 3) array_like
            Camera centres in the ground-truth and in the estimated world. An estimate that is not
            finite is missing.
        gt_rotations, est_rotations : (n, 3, 3) array_like or None
            Camera-to-world rotations; None where the metric needs none.
        rng : int, SeedSequence, Generator or None
            Seed, where the metric is random.

        Returns
        -------
        float
            The value, in the family's unit.

        Raises
        ------
        ValueError
            Where the input is malformed, or rotations are needed and there are none.
        NoValueError
            Where the protocol has no value for these cameras.
        """
        arguments = dict(self.arguments)
        if self.family.random:
            arguments["rng"] = rng
        if not self.family.rotations:
            return self.family.function(gt_positions, est_positions, **arguments)
        if gt_rotations is None or est_rotations is None:
            raise ValueError(f"{self.name} needs the rotations of the cameras")
        poses = (
            _poses(gt_rotations, gt_positions, "gt", complete=True),
            _poses(est_rotations, est_positions, "est", complete=False),
        )
        return self.family.function(*poses, **arguments)


def protocol(name: str) -> Protocol:
    """Find a metric by its name.

    Parameters
    ----------
    name : str
        Such as ``auc@30:vggt``, ``auc@5:colmap``, ``maa:imc``, ``recall@5cm,5deg``, ``rpe@1m``,
        ``kitti``, ``ate:rmse``; see `PROTOCOLS`.

    Returns
    -------
    Protocol
        Call it with cameras.

    Raises
    ------
    ValueError
        Where there is none of that name; the message lists those that are close to it.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.protocols import protocol
    >>> ate = protocol("ate:mean:none")
    >>> positions = np.eye(3)
    >>> ate(positions, None, positions + [2, 0, 0], None)
    2.0
    >>> protocol("auc@30")
    Traceback (most recent call last):
        ...
    ValueError: unknown metric 'auc@30'; close to it are auc@30:vggt, auc@30:vggt-old, auc@5:colmap
    """
    asked = name.strip().lower()
    for family in PROTOCOLS:
        arguments = family.arguments(asked)
        if arguments is not None:
            return Protocol(asked, family, arguments)
    examples = [family.example for family in PROTOCOLS]
    head = re.split("[@:]", asked)[0]
    same = [one for one in examples if re.split("[@:]", one)[0] == head]
    close = get_close_matches(asked, same or examples, n=3, cutoff=0) or examples
    raise ValueError(f"unknown metric {name!r}; close to it are {', '.join(close)}")


def split_names(text: str) -> list[str]:
    """Split a list of names at its commas, but for those inside a name.

    Parameters
    ----------
    text : str
        As after ``--metrics``.

    Returns
    -------
    list of str
        The names.

    Examples
    --------
    >>> from alignscores.protocols import split_names
    >>> split_names("tas, recall@5cm,5deg:hloc,kitti")
    ['tas', 'recall@5cm,5deg:hloc', 'kitti']
    """
    return [name.strip() for name in re.split(r",(?!\s*[\d.])", text)]


def _numbers(match: re.Match[str]) -> dict[str, float]:
    """Return the numbers of a head by the arguments that they set."""
    groups = {key: text for key, text in match.groupdict().items() if text is not None}
    unit = UNITS[groups.pop("unit", "m")]
    return {
        key: int(text) if key == "k" else float(text) / (unit if key in LENGTHS else 1)
        for key, text in groups.items()
    }


def _poses(rotations: ArrayLike, positions: ArrayLike, world: str, *, complete: bool) -> Floats:
    """Join rotations and positions."""
    names = f"{world}_rotations", f"{world}_positions"
    turned = check_rotations(rotations, names[0], complete=complete)
    placed = check_positions(positions, names[1], complete=complete)
    check_same_length(turned, placed, *names)
    if np.asarray(rotations).dtype == np.float32:
        turned = nearest_rotations(turned)
    return np.concatenate([turned, placed[:, :, None]], axis=2)


PROTOCOLS: Sequence[Family] = (
    Family(
        "rra@K:{vggt,mapanything,da3}",
        "rra@5:vggt",
        "relative rotation accuracy: pairs with a rotation error below K degrees",
        vggt_rra,
        f"rra{WHOLE}",
        "fail",
        required=CONVENTION,
        unit="%",
        larger_is_better=True,
    ),
    Family(
        "rta@K:{vggt,mapanything,da3}",
        "rta@5:vggt",
        "relative translation accuracy: pairs with a direction error, sign folded, below K degrees",
        vggt_rta,
        f"rta{WHOLE}",
        "fail",
        required=CONVENTION,
        unit="%",
        larger_is_better=True,
    ),
    Family(
        "auc@K:{vggt,mapanything,da3}",
        "auc@30:vggt",
        "area under the accuracy of relative poses up to K degrees, in bins of one degree",
        vggt_auc,
        f"auc{WHOLE}",
        "fail",
        required=CONVENTION,
        unit="%",
        larger_is_better=True,
    ),
    Family(
        "auc@K:vggt-old",
        "auc@30:vggt-old",
        "the same in K + 1 equal bins, the older form",
        partial(vggt_auc, bins="histogram"),
        f"auc{WHOLE}",
        "fail",
        origin="vggt-old",
        unit="%",
        larger_is_better=True,
    ),
    Family(
        "auc@ANGLE:{colmap,colmap-imc}",
        "auc@5:colmap",
        "area under the interpolated recall of relative poses, of COLMAP's benchmark",
        colmap_relative_auc,
        f"auc@{ANGLE}",
        "fail",
        required=ACCURACY,
        unit="%",
        larger_is_better=True,
    ),
    Family(
        "recall@ANGLE:{colmap,colmap-imc}",
        "recall@5deg:colmap",
        "recall of relative poses, of COLMAP's benchmark",
        colmap_relative_recall,
        f"recall@{ANGLE}",
        "fail",
        required=ACCURACY,
        unit="%",
        larger_is_better=True,
    ),
    Family(
        "auc@DISTANCE:{colmap,colmap-imc}",
        "auc@5cm:colmap",
        "area under the interpolated recall of positions after a robust similarity, of COLMAP's "
        "benchmark",
        colmap_absolute_auc,
        f"auc@{ERROR}",
        "fail",
        required=ACCURACY,
        unit="%",
        larger_is_better=True,
        rotations=False,
        random=True,
    ),
    Family(
        "recall@DISTANCE:{colmap,colmap-imc}",
        "recall@5cm:colmap",
        "recall of positions after a robust similarity, of COLMAP's benchmark",
        colmap_absolute_recall,
        f"recall@{ERROR}",
        "fail",
        required=ACCURACY,
        unit="%",
        larger_is_better=True,
        rotations=False,
        random=True,
    ),
    Family(
        "maa:imc",
        "maa:imc",
        "mean accuracy of positions under the best similarity for each of 7 thresholds from 2 to "
        "20 cm, of the Image Matching Challenge 2025",
        imc_maa,
        "maa",
        "fail",
        origin="imc",
        larger_is_better=True,
        rotations=False,
    ),
    Family(
        "maa:imc24",
        "maa:imc24",
        "the same with 6 thresholds from 2.5 cm to 1 m, of 2024",
        partial(imc_maa, thresholds=IMC_2024, skip=0),
        "maa",
        "fail",
        origin="imc24",
        larger_is_better=True,
        rotations=False,
    ),
    Family(
        "recall@DISTANCE,ANGLE[:{ace0,ace0-new}]",
        "recall@5cm,5deg",
        "images within distance and angle after a robust similarity, of ACE0 (-new: with SciPy "
        "1.17)",
        ace0_recall,
        f"recall@{ERROR},{ANGLE}",
        "fail",
        optional={"true_angles": {"ace0": False, "ace0-new": True}},
        unit="%",
        larger_is_better=True,
        random=True,
    ),
    Family(
        "recall@DISTANCE,ANGLE:{hloc,hloc-sim3}",
        "recall@5cm,5deg:hloc-sim3",
        "images within distance and angle, of hloc: not aligned (-sim3: by least squares)",
        hloc_recall,
        f"recall@{ERROR},{ANGLE}",
        "fail",
        required=HLOC,
        unit="%",
        larger_is_better=True,
    ),
    Family(
        "median:{hloc,hloc-sim3}",
        "median:hloc",
        "median distance of the images, of hloc",
        hloc_median,
        "median",
        "fail",
        required=HLOC,
        unit="units",
    ),
    Family(
        "median:{hloc,hloc-sim3}:rotation",
        "median:hloc:rotation",
        "median angle of the images, of hloc",
        hloc_median,
        "median",
        "fail",
        required=HLOC | ROTATION,
        unit="deg",
    ),
    Family(
        "ate[:STATISTIC][:ALIGNMENT]",
        "ate:rmse",
        "absolute trajectory error, of evo",
        evo_ate,
        "ate",
        "left out",
        optional=ALIGNED,
        unit="units",
        rotations=False,
    ),
    Family(
        "ate:mapanything",
        "ate:mapanything",
        "mean distance without a scale, of MapAnything",
        mapanything_ate,
        "ate",
        "left out",
        origin="mapanything",
        unit="estimated units",
        rotations=False,
    ),
    Family(
        "are[:STATISTIC][:ALIGNMENT]",
        "are:rmse",
        "absolute rotation error after an alignment of the positions, of evo",
        evo_are,
        "are",
        "left out",
        optional=ALIGNED,
        unit="deg",
    ),
    Family(
        "rpe@{1f,DISTANCE}[:distance][:PATH][:STATISTIC][:ALIGNMENT]",
        "rpe@1m",
        "relative translation error from frame to frame, or over a distance, of evo",
        evo_rpe,
        rf"rpe@(?:1f|(?P<distance>{NUMBER}){UNIT})",
        "left out",
        optional={"error": {name: name for name in ("translation", "distance")}} | ALIGNED | PAIRS,
        unit="units",
        ordered=True,
    ),
    Family(
        "rpe@{1f,DISTANCE}:rotation[:PATH][:STATISTIC][:ALIGNMENT]",
        "rpe@1m:rotation",
        "relative rotation error from frame to frame, or over a distance, of evo",
        evo_rpe,
        rf"rpe@(?:1f|(?P<distance>{NUMBER}){UNIT})",
        "left out",
        required=ROTATION,
        optional=ALIGNED | PAIRS,
        unit="deg",
        ordered=True,
    ),
    Family(
        "kitti",
        "kitti",
        "mean relative translation error over 100 to 800 m, of the KITTI benchmark",
        kitti_relative_error,
        "kitti",
        "refused",
        unit="%",
        ordered=True,
    ),
    Family(
        "kitti:rotation",
        "kitti:rotation",
        "mean relative rotation error over 100 to 800 m, of the KITTI benchmark",
        kitti_relative_error,
        "kitti",
        "refused",
        required=ROTATION,
        unit="deg/unit",
        ordered=True,
    ),
    Family(
        "rpg@DISTANCE[:STATISTIC][:{sim3,se3}]",
        "rpg@100m",
        "relative translation error over a path length, of rpg_trajectory_evaluation",
        partial(rpg_relative_error, error="percent"),
        rf"rpg@(?P<length>{NUMBER}){UNIT}",
        "left out",
        optional=SCALED,
        unit="%",
        ordered=True,
    ),
    Family(
        "rpg@DISTANCE:rotation[:STATISTIC][:{sim3,se3}]",
        "rpg@100m:rotation",
        "relative rotation error over a path length, of rpg_trajectory_evaluation",
        rpg_relative_error,
        rf"rpg@(?P<length>{NUMBER}){UNIT}",
        "left out",
        required={"error": {"rotation": "rotation/length"}},
        optional=SCALED,
        unit="deg/unit",
        ordered=True,
    ),
)
"""All families of names. To add a protocol, add its entry."""
