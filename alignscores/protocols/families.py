"""Families of metrics: how their names are read, and what is known of each.

A name is a head, mostly with numbers, and words behind colons in any order: ``auc@30:vggt``,
``recall@5cm,5deg:hloc``, ``rpe@1m:rotation:all``. This module alone reads them.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..averaging import nearest_rotations
from ..registration import Seed
from ..validation import check_positions, check_rotations, check_same_length

__all__ = ["UNITS", "Family", "Metric", "Missing", "find", "split_names"]

UNITS = {"mm": 1000, "cm": 100, "m": 1}  # in a metre, which is a unit of the ground truth
LENGTHS = {"distance", "length", "max_error"}  # arguments in units of the ground truth

Missing = Literal["fail", "left out", "refused"]
Words = Mapping[str, Any]


@dataclass(frozen=True)
class Family:
    """Names that are read alike and differ in numbers and words.

    Parameters
    ----------
    syntax, example, description : str
        The names as a list shows them, one of them, and what the value is.
    function : callable
        Of poses, or positions if no rotations are needed, and of the arguments that the name sets.
    head : str
        Regular expression of the name up to the first colon; its groups set arguments.
    missing : {"fail", "left out", "refused"}
        What happens to cameras without an estimate.
    required, optional : mapping of str to mapping
        Words and the values that they give to an argument; the first optional one is the default.
    unit : str
        "%", "deg", "deg/unit", "units" (of the ground truth; "estimated units") or none.
    larger_is_better, rotations, ordered, random, metres : bool
        Whether it is a score, needs rotations, needs the order of time, depends on the seed, has
        lengths in metres that no name sets.
    aliases : tuple of str
        Other names of `example`, in lower case.

    Examples
    --------
    >>> from alignscores.protocols import protocol
    >>> family = protocol("recall@5cm,5deg:hloc").family
    >>> family.unit, family.larger_is_better, family.missing, family.random
    ('%', True, 'fail', False)
    """

    syntax: str
    example: str
    description: str
    function: Callable[..., float]
    head: str
    missing: Missing
    required: Mapping[str, Words] = field(default_factory=dict)
    optional: Mapping[str, Words] = field(default_factory=dict)
    unit: str = ""
    larger_is_better: bool = False
    rotations: bool = True
    ordered: bool = False
    random: bool = False
    metres: bool = False
    aliases: tuple[str, ...] = ()

    def arguments(self, name: str) -> dict[str, Any] | None:
        """Return the arguments that a name, in lower case, sets; None if it is another family's."""
        head, *words = name.split(":")
        match = re.fullmatch(self.head, head)
        if match is None:
            return None
        chosen: dict[str, Any] = {}
        choices = {**self.required, **self.optional}
        for word in words:
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
class Metric:
    """One metric by its name; call it with cameras.

    Parameters
    ----------
    name : str
        Its name; of a protocol in lower case.
    family : Family
        Unit, direction, needed input, and what happens to missing cameras.
    arguments : mapping of str to object
        Arguments of the family's function that the name sets.

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

    @property
    def metres(self) -> bool:
        """Whether it has thresholds or lengths in metres; a unit of the reference counts as one."""
        return self.family.metres or not LENGTHS.isdisjoint(self.arguments)

    @property
    def timed(self) -> bool:
        """Whether it needs time stamps."""
        return "seconds" in self.arguments

    @property
    def worst(self) -> float:
        """The value of an estimate that failed: 0 of a score, infinite of an error."""
        return 0.0 if self.family.larger_is_better else math.inf

    def __call__(
        self,
        gt_positions: ArrayLike,
        gt_rotations: ArrayLike | None,
        est_positions: ArrayLike,
        est_rotations: ArrayLike | None,
        *,
        rng: Seed = 0,
        stamps: ArrayLike | None = None,
    ) -> float:
        """Evaluate the metric.

        Parameters
        ----------
        gt_positions, est_positions : (n, 3) array_like
            Camera centres, row i of both the same camera. A row that is not finite is missing.
        gt_rotations, est_rotations : (n, 3, 3) array_like or None
            Camera-to-world rotations; None where the metric needs none.
        rng : int, SeedSequence, Generator or None
            Seed, where the metric is random.
        stamps : (n,) array_like, optional
            Time stamps in seconds, where the metric needs them.

        Returns
        -------
        float
            The value, in the family's unit.

        Raises
        ------
        ValueError
            If the input is malformed, or rotations are needed and there are none.
        NoValueError
            If the protocol has no value for these cameras.
        """
        arguments = dict(self.arguments)
        if self.family.random:
            arguments["rng"] = rng
        if self.timed:
            arguments["stamps"] = stamps
        if not self.family.rotations:
            return self.family.function(gt_positions, est_positions, **arguments)
        if gt_rotations is None or est_rotations is None:
            raise ValueError(f"{self.name} needs the rotations of the cameras")
        poses = (
            _poses(gt_rotations, gt_positions, "gt", complete=True),
            _poses(est_rotations, est_positions, "est", complete=False),
        )
        return self.family.function(*poses, **arguments)


def find(name: str, families: Sequence[Family]) -> Metric:
    """Find a metric by its name, whatever its case, or by another one; `ValueError` without one."""
    asked = name.strip().lower()
    for family in families:
        example = family.example.lower()
        is_example = asked == example or asked in family.aliases
        arguments = family.arguments(example if is_example else asked)
        if arguments is not None:
            return Metric(family.example if is_example else asked, family, arguments)
    examples = {family.example.lower(): family.example for family in families}
    head = re.split("[@:]", asked)[0]
    same = [example for example in examples if re.split("[@:]", example)[0] == head]
    close = get_close_matches(asked, same or examples, n=3, cutoff=0) or examples
    listed = ", ".join(examples[example] for example in close)
    raise ValueError(f"unknown metric {name!r}; close to it are {listed}")


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
        key: int(text) if key in ("k", "frames") else float(text) / (unit if key in LENGTHS else 1)
        for key, text in groups.items()
    }


def _poses(rotations: ArrayLike, positions: ArrayLike, frame: str, *, complete: bool) -> Floats:
    """Join rotations and positions."""
    names = f"{frame}_rotations", f"{frame}_positions"
    axes = check_rotations(rotations, names[0], complete=complete)
    centres = check_positions(positions, names[1], complete=complete)
    check_same_length(axes, centres, *names)
    if np.asarray(rotations).dtype == np.float32:
        axes = nearest_rotations(axes)
    return np.concatenate([axes, centres[:, :, None]], axis=2)
