"""`Metric`: a function of cameras with a name, and what is known about its values."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import partial
from typing import Any, Literal

import numpy as np

__all__ = ["UNITS", "Metric", "Need", "angle", "find", "length", "split_names", "whole"]

UNITS = {"mm": 1000, "cm": 100, "m": 1}  # in a metre, which is a unit of the ground truth
LISTED = "`alignscores metrics` lists all"
NUMBER = r"\d+(?:\.\d+)?|\.\d+"

Need = Literal["rotations", "order", "metres", "evo"]


@dataclass(frozen=True, eq=False)
class Metric:
    """A metric: a function of cameras with a name, and what is known about its values.

    Parameters
    ----------
    name : str
        As users write it. In a list an argument is in capitals, ``auc@K:vggt``.
    function : callable
        ``function(gt_poses, est_poses)`` of camera-to-world poses, (n, 3, 4) or (n, 4, 4), row i of
        both the same camera; of the positions, (n, 3), if it needs no rotations. Rows of the
        estimate that are not finite were not estimated. It returns a number.
    unit : str
        "%", "deg", "deg/unit", "rad", "units" (of the ground truth) or none.
    larger_is_better : bool
        Whether it is a score, not an error.
    needs : tuple of {"rotations", "order", "metres", "evo"}
        What it needs: rotations, poses in the order of time, a ground truth in metres, evo.
    description : str
        What the value is, in a line.
    argument : callable, optional
        Reads the text after ``@`` of a name: returns arguments of the function, or None.
    options : mapping of str to sequence of str
        Arguments of the function that words after colons set, such as ``rpe@1m:sim3``: the first
        word is the default.
    example : str
        A name of the metric, if it has an argument.
    sets : bool
        Whether its function also takes several models of a scene, (m, n, 4, 4), and ``outliers``:
        the number of images in each that the ground truth lacks.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores.metrics import Metric
    >>> def largest_error(gt, est):
    ...     return np.linalg.norm(gt - est, axis=1).max()
    >>> metric = Metric("largest", largest_error, unit="units", needs=())
    >>> poses = np.tile(np.eye(4), (3, 1, 1))
    >>> metric(poses, poses), metric.worst
    (0.0, inf)
    """

    name: str
    function: Callable[..., Any]
    unit: str = ""
    larger_is_better: bool = False
    needs: tuple[Need, ...] = ("rotations",)
    description: str = ""
    argument: Callable[[str], Mapping[str, Any] | None] | None = None
    options: Mapping[str, Sequence[str]] = field(default_factory=dict)
    example: str = ""
    sets: bool = False

    def __call__(self, gt_poses: Any, est_poses: Any) -> float:
        """Return the value for camera-to-world poses.

        Parameters
        ----------
        gt_poses, est_poses : (n, 3, 4) or (n, 4, 4) array_like
            Poses, row i of both the same camera. A row that is not finite is missing.

        Returns
        -------
        float
            The value, in the unit of the metric.

        Raises
        ------
        ValueError
            If the input is malformed.
        NoValueError
            If the metric has no value for these cameras.
        ModuleNotFoundError
            If the metric needs a package that is not installed.
        """
        if "rotations" in self.needs:
            return float(self.function(gt_poses, est_poses))
        positions = (np.asarray(poses)[..., :3, 3] for poses in (gt_poses, est_poses))
        return float(self.function(*positions))

    @property
    def sign(self) -> int:
        """1 if larger is better, otherwise -1."""
        return 1 if self.larger_is_better else -1

    @property
    def worst(self) -> float:
        """The value of an estimate that failed: 0 of a score, infinite of an error."""
        return 0.0 if self.larger_is_better else math.inf

    @property
    def syntax(self) -> str:
        """The name with all options, in brackets where they may be left out."""
        optional = (word.upper() for word in self.options)
        return self.name + "".join(f"[:{word}]" for word in optional)


def find(name: str, metrics: Sequence[Metric], which: str = LISTED) -> Metric:
    """Return the metric of a name, whatever its case and underscores; `ValueError` without one.

    The message has close names, or else which metrics there are.
    """
    wanted = name.strip().lower()
    for entry in metrics:
        arguments = _arguments(entry, wanted)
        if arguments == {}:
            return entry
        if arguments is not None:
            return replace(entry, name=wanted, function=partial(entry.function, **arguments))
    examples = [entry.example or entry.name for entry in metrics]
    same = [example for example in examples if _split(example)[0] == _split(wanted)[0]]
    lower = {example.lower(): example for example in same or examples}
    close = get_close_matches(wanted, lower, n=3, cutoff=0 if same else 0.6)
    suggestion = f"close to it are {', '.join(lower[key] for key in close)}"
    raise ValueError(f"unknown metric {name!r}; {suggestion if close else which}")


def _split(name: str) -> tuple[str, str, list[str]]:
    """Split ``head@argument:word:word``."""
    first, *words = name.split(":")
    head, _, argument = first.partition("@")
    return head.lower().replace("_", ""), argument, words


def _arguments(entry: Metric, name: str) -> dict[str, Any] | None:
    """Return the arguments of an entry's function that a name sets; None if it is another's."""
    head, placeholder, fixed = _split(entry.name)
    asked_head, argument, words = _split(name)
    if head != asked_head or not set(fixed) <= set(words) or bool(placeholder) != bool(argument):
        return None
    options = [word for word in words if word not in fixed]
    chosen = {key: word for word in options for key in entry.options if word in entry.options[key]}
    if len(words) != len(fixed) + len(chosen):  # an unknown word, or two for the same argument
        return None
    read = entry.argument(argument) if entry.argument else {}
    if read is None:
        return None
    defaults = {key: choices[0] for key, choices in entry.options.items()}
    return {**defaults, **chosen, **read}


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
    >>> from alignscores.metrics import split_names
    >>> split_names("tas, recall@5cm,5deg:hloc,kitti")
    ['tas', 'recall@5cm,5deg:hloc', 'kitti']
    """
    return [name.strip() for name in re.split(r",(?!\s*[\d.])", text)]


def whole(text: str) -> int | None:
    """Read a positive whole number of degrees, ``30`` or ``30deg``."""
    match = re.fullmatch(r"(\d+)(?:deg)?", text)
    return int(match[1]) or None if match else None


def angle(text: str) -> float | None:
    """Read a positive angle in degrees, ``2.5`` or ``2.5deg``."""
    match = re.fullmatch(rf"({NUMBER})(?:deg)?", text)
    return float(match[1]) or None if match else None


def length(text: str) -> float | None:
    """Read a positive length in mm, cm or m; in metres."""
    match = re.fullmatch(rf"({NUMBER})(mm|cm|m)", text)
    return float(match[1]) / UNITS[match[2]] or None if match else None
