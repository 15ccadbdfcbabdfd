"""The settings of an evaluation: their names, defaults, bounds and help stand here alone."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass
from functools import cache, partial
from os import PathLike
from typing import Annotated, Any, get_type_hints

import numpy as np

from ..arrays import Floats
from ..metrics import metric
from ..protocols import split_names
from ..registration import REGISTRATIONS
from ..similarity import ALIGNMENTS, UP
from ..texts import brief, printable
from ..trajectories.association import MISSING, SYNCS
from ..trajectories.files import FilePath
from ..trajectories.formats import FORMATS, Format

__all__ = ["Option", "Settings", "options", "order_problem"]


@dataclass(frozen=True)
class Option:
    """What a setting means, and which values it may have."""

    help: str
    _: KW_ONLY
    group: str
    choices: tuple[str, ...] = ()
    number: type[int] | type[float] | None = None
    least: float = -math.inf
    most: float = math.inf
    positive: bool = False
    words: tuple[str, ...] = ()  # taken instead of a number
    flag: bool = False  # True or False
    optional: bool = False  # None is a value
    timed: bool = False  # of formats with time stamps alone
    topics: bool = False  # of formats with topics alone

    def checked(self, value: Any) -> Any:
        """Return a value, a number as Python's; raise a ValueError where it cannot be that."""
        if (value is None and self.optional) or (isinstance(value, str) and value in self.words):
            return value
        if self.choices and value not in self.choices:
            raise ValueError(f"must be one of {', '.join(self.choices)}, not {brief(value)}")
        if self.flag and not isinstance(value, bool):
            raise ValueError(f"must be true or false, not {brief(value)}")
        if self.number is None:
            return value
        if not self._is_possible(value):
            raise ValueError(f"must be {self._range()}, not {brief(value)}")
        return self.number(value)

    def parse(self, text: str) -> float | str:
        """Return the number, or the word, that stands in a text."""
        if text in self.words:
            return text
        assert self.number is not None
        try:
            value = self.number(text)
        except ValueError:
            value = math.nan
        if not self._is_possible(value):
            raise ValueError(f"must be {self._range()}, not {brief(text)}")
        return value

    def _is_possible(self, value: Any) -> bool:
        whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
        if not (whole or (self.number is float and isinstance(value, (float, np.floating)))):
            return False
        if self.positive and value == 0:
            return False
        try:
            return math.isfinite(value) and bool(self.least <= value <= self.most)
        except OverflowError:  # a whole number beyond all floats
            return False

    def _range(self) -> str:
        kind = "a whole number" if self.number is int else "a finite number"
        if self.positive:
            bound = " above 0"
        elif self.most < math.inf:
            bound = f" from {self.least:g} to {self.most:g}"
        else:
            bound = f" of at least {self.least:g}" if self.least > -math.inf else ""
        return f"{kind}{bound}{''.join(f' or {word}' for word in self.words)}"


Matching = partial(Option, group="which poses belong together")
Scoring = partial(Option, group="scoring")
Number = partial(Scoring, number=float, least=0)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How estimates are matched with their reference and scored.

    Parameters
    ----------
    format : str, optional
        Format of the files, such as tum. Trajectories in memory need none.
    est_format : str, optional
        Format of the estimates, where it is another one.
    ref_topic, est_topic : str, optional
        Topics of bags of ROS; by default the only one with poses.
    missing : {"fail", "ignore"}
        Whether cameras without an estimate count as failures, or are left out. Of KITTI files each
        line of the reference has one of the estimate, so that none is missing.
    t_max_diff : float
        Largest difference of associated time stamps, in seconds.
    sync : {"interpolate", "nearest"}
        Whether a pose is compared with the reference at its own time, or with the nearest reference
        pose within ``t_max_diff``.
    rate : float or "all"
        Expected frames a second, sampled from the reference; "all": each of its poses.
    max_gap : float
        Largest gap in seconds between two poses that cover all the time between them: each pose
        covers half of it on either side. 0: each frame needs a pose.
    t_start, t_end : float, optional
        First and last time that is expected, in seconds; by default those of the reference.
    t_offset : float or "auto"
        Added to the time stamps of the estimate, in seconds; "auto": that at which the rotation
        rates, or without rotations the speeds, fit at least twice as well, otherwise 0.
    frames : path or (k,) array, optional
        Time stamps of the expected frames, instead of ``rate``, or a text file with them in its
        first column.
    invert : bool
        Whether the estimates are world-to-camera, and are to be inverted.
    body_rotation : {"none", "auto"}
        Whether a constant rotation of the camera's frame is taken out, if one is found.
    unit : float, optional
        d in the reference's unit; by default it is derived from the reference.
    max_threshold : float
        Largest threshold of the TAS in units of d.
    max_threshold_deg : float
        Largest threshold of the RAS in degrees.
    weight : float
        Share of the TAS in the PAS.
    registration : {"refined", "pcr99"}
        How the TAS aligns. "pcr99" is the paper's; its scores are means over ``repeat`` seeds.
    alignment : {"similarity", "rigid", "yaw", "none"}
        What the alignment may take out: "similarity", the paper's, a rotation, a translation and
        the scale; "rigid" no scale; "yaw" a turn about the vertical axis and a translation; "none"
        nothing. It holds for TAS, RAS and ATE; other metrics have alignments of their own.
    up : {"z", "y", "x", "-z", "-y", "-x"}
        Vertical axis of both worlds, for "yaw" alone; its sign changes nothing.
    seed : int
        First seed of the registration. Errors and alignments are of this one.
    repeat : int
        Number of seeds that TAS and PAS by pcr99 are means over. The refined registration, which
        hardly depends on the seed, takes one.
    metrics : tuple of str
        Metrics besides the scores, such as "auc@30:vggt"; a text of names with commas is split.

    Raises
    ------
    ValueError
        Where a setting cannot have its value; the message names it.

    Examples
    --------
    >>> from alignscores import Settings
    >>> Settings(format="tum", t_max_diff=0.02).registration
    'refined'
    >>> Settings(weight=2)
    Traceback (most recent call last):
    ValueError: weight must be a finite number from 0 to 1, not 2
    """

    format: Annotated[
        str | None, Matching("format of the files", choices=tuple(FORMATS), optional=True)
    ] = None
    est_format: Annotated[
        str | None,
        Matching(
            "format of the estimates, if it is another one", choices=tuple(FORMATS), optional=True
        ),
    ] = None
    ref_topic: Annotated[
        str | None, Matching("topic of the reference in its bag", optional=True, topics=True)
    ] = None
    est_topic: Annotated[
        str | None, Matching("topic of the estimates in their bags", optional=True, topics=True)
    ] = None
    missing: Annotated[
        str,
        Matching("cameras without an estimate count as failures, or are left out", choices=MISSING),
    ] = "fail"
    t_max_diff: Annotated[
        float,
        Matching(
            "largest difference of associated stamps, in s", number=float, least=0, timed=True
        ),
    ] = 0.01
    sync: Annotated[
        str,
        Matching(
            "compare a pose with the reference interpolated at its time, or with the nearest pose",
            choices=SYNCS,
            timed=True,
        ),
    ] = "interpolate"
    rate: Annotated[
        float | str,
        Matching(
            "expected frames a second, sampled from the reference; all: each of its poses",
            number=float,
            positive=True,
            least=0,
            words=("all",),
            timed=True,
        ),
    ] = 10.0
    max_gap: Annotated[
        float,
        Matching(
            "largest gap between two poses that cover all the time between them, in s: each pose "
            "covers half of it on either side; 0: each frame needs a pose",
            number=float,
            least=0,
            timed=True,
        ),
    ] = 2.0
    t_start: Annotated[
        float | None,
        Matching("first time that is expected, in s", number=float, optional=True, timed=True),
    ] = None
    t_end: Annotated[
        float | None,
        Matching("last time that is expected, in s", number=float, optional=True, timed=True),
    ] = None
    t_offset: Annotated[
        float | str,
        Matching(
            "added to the estimate's time stamps, in s; auto: found by the rotation rates",
            number=float,
            words=("auto",),
            timed=True,
        ),
    ] = 0.0
    frames: Annotated[
        FilePath | Floats | tuple[float, ...] | None,
        Matching(
            "time stamps of the expected frames, instead of --rate, in the first column of a text "
            "file, in s or ns, as the estimate has them (implies --missing fail)",
            timed=True,
        ),
    ] = None
    invert: Annotated[
        bool, Matching("the estimates are world-to-camera: invert them", flag=True)
    ] = False
    body_rotation: Annotated[
        str,
        Matching(
            "take a constant rotation of the camera's frame out, if one is found",
            choices=("auto", "none"),
        ),
    ] = "none"
    unit: Annotated[
        float | None,
        Number(
            "d in the reference's unit (default: from the reference)", positive=True, optional=True
        ),
    ] = None
    max_threshold: Annotated[
        float, Number("largest threshold of the TAS in units of d", positive=True)
    ] = 1.0
    max_threshold_deg: Annotated[
        float, Number("largest threshold of the RAS in degrees", positive=True)
    ] = 10.0
    weight: Annotated[float, Number("share of the TAS in the PAS, from 0 to 1", most=1)] = 0.5
    registration: Annotated[
        str,
        Scoring("how the TAS aligns; pcr99 is the paper's", choices=tuple(sorted(REGISTRATIONS))),
    ] = "refined"
    alignment: Annotated[
        str,
        Scoring(
            "what is aligned: similarity, the paper's, takes out rotation, translation and scale; "
            "rigid keeps the scale; yaw turns about the vertical axis alone; none aligns nothing",
            choices=ALIGNMENTS,
        ),
    ] = "similarity"
    up: Annotated[str, Scoring("the vertical axis, for --alignment yaw", choices=UP)] = "z"
    seed: Annotated[
        int,
        Scoring(
            "first seed of the registration; errors, plots and saved files are of this one",
            number=int,
            least=0,
        ),
    ] = 0
    repeat: Annotated[
        int,
        Scoring(
            "seeds, from --seed on, that TAS, PAS and their sd by pcr99 are over; the refined "
            "registration, which hardly depends on it, takes one",
            number=int,
            least=1,
        ),
    ] = 10
    metrics: Annotated[
        tuple[str, ...],
        Option(
            "by name, such as auc@30:vggt,recall@5cm,5deg:hloc,rpe@1m; --metrics help lists all",
            group="output",
        ),
    ] = ()

    def __post_init__(self) -> None:
        values: dict[str, Any] = {}
        for name, option in options().items():
            try:
                values[name] = option.checked(getattr(self, name))
            except ValueError as error:
                raise ValueError(f"{name} {error}") from None
        values["frames"] = _stamps_or_path(self.frames)
        names = split_names(self.metrics) if isinstance(self.metrics, str) else self.metrics
        values["metrics"] = tuple(dict.fromkeys(metric(name).name for name in names))
        for name, value in values.items():
            object.__setattr__(self, name, value)
        if self.up != Settings.up and self.alignment != "yaw":
            raise ValueError("up is used by alignment=yaw alone: set that, too, or leave up out")
        if self.frames is not None and self.missing == "ignore":
            raise ValueError("frames without a pose fail: leave missing=ignore out, or frames")
        if self.frames is not None and self.t_offset == "auto":
            raise ValueError(
                "frames need t_offset in seconds: auto would move them with each estimate"
            )
        if self.format:
            self._check_format()

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as JSON has them; None for those that the format has not.

        Returns
        -------
        dict
            The keys are described in ``docs/reference/results.md``.

        Examples
        --------
        >>> from alignscores import Settings
        >>> Settings(format="tum", max_gap=2).to_dict()["max_gap"]
        2.0
        """
        timed = self.form.timed
        frames = printable(str(self.frames)) if isinstance(self.frames, (str, PathLike)) else None
        return {
            "format": self.format,
            "est_format": self.est_format or self.format,
            "ref_topic": self.ref_topic,
            "est_topic": self.est_topic,
            "missing_cameras": self.missing_cameras,
            "t_max_diff": self.t_max_diff if timed else None,
            "t_offset": self.t_offset if timed else None,
            "sync": self.sync if timed else None,
            "rate": self.rate if timed and self.frames is None else None,
            "max_gap": self.max_gap if timed else None,
            "t_start": self.t_start,
            "t_end": self.t_end,
            "frames": frames or self.frames,
            "unit": self.unit,
            "max_threshold": self.max_threshold,
            "max_threshold_deg": self.max_threshold_deg,
            "weight": self.weight,
            "registration": self.registration,
            "alignment": self.alignment,
            "up": self.up if self.alignment == "yaw" else None,
            "seed": self.seed,
            "repeat": len(self.seeds),
            "inverted": self.invert,
            "body_rotation": self.body_rotation,
        }

    def _check_format(self) -> None:
        """Refuse what needs time stamps, or an order of the cameras, where there is none."""
        for name, option in options().items():
            changed = getattr(self, name) != getattr(Settings, name)
            if option.timed and changed and not self.form.timed:
                raise ValueError(f"{name} needs time stamps, which {self.format} files lack")
            if option.topics and changed and not (self.form.topics or self.est_form.topics):
                raise ValueError(f"{name} is of bags, and {self.format} files have no topics")
        if wrong := order_problem(self.metrics, self.form):
            raise ValueError(wrong)

    @property
    def seeds(self) -> range:
        """The seeds that are scored: a single one where the score hardly depends on it.

        Examples
        --------
        >>> from alignscores import Settings
        >>> Settings(registration="pcr99", repeat=3).seeds
        range(0, 3)
        """
        drawn = self.registration == "pcr99" and self.alignment != "none"
        repeat = self.repeat if drawn else 1
        return range(self.seed, self.seed + repeat)

    @property
    def frames_per_second(self) -> float:
        """Rate of the expected frames; infinite where each pose of the reference is one.

        Examples
        --------
        >>> from alignscores import Settings
        >>> Settings(format="tum", rate="all").frames_per_second
        inf
        """
        return math.inf if self.rate == "all" else float(self.rate)

    @property
    def how_aligned(self) -> str:
        """Registration and alignment in words, as tables and plots name them.

        Examples
        --------
        >>> from alignscores import Settings
        >>> Settings(alignment="yaw", up="y").how_aligned
        'registration refined, aligned about the y axis, without scale'
        """
        kind = {
            "similarity": f"registration {self.registration}",
            "rigid": f"registration {self.registration}, aligned without scale",
            "yaw": f"registration {self.registration}, aligned about the {self.up[-1]} axis, "
            "without scale",
            "none": "not aligned",
        }
        return kind[self.alignment]

    @property
    def form(self) -> Format:
        """The format of the files.

        Examples
        --------
        >>> from alignscores import Settings
        >>> Settings(format="kitti").form.unit
        'm'
        """
        if self.format is None:
            raise ValueError(f"give the format of the files: format={'|'.join(FORMATS)}")
        return FORMATS[self.format]

    @property
    def est_form(self) -> Format:
        """The format of the estimates.

        Examples
        --------
        >>> from alignscores import Settings
        >>> Settings(format="euroc", est_format="tum").est_form.quaternions
        True
        """
        return FORMATS[self.est_format] if self.est_format else self.form

    @property
    def missing_cameras(self) -> str | None:
        """What missing cameras do; None where the format has none.

        Examples
        --------
        >>> from alignscores import Settings
        >>> Settings(format="tum").missing_cameras
        'fail'
        """
        return self.missing if self.form.missing else None


def order_problem(metrics: Sequence[str], form: Format) -> str:
    """Say which metric needs an order of the cameras, or stamps, that the format lacks."""
    for name in metrics:
        if metric(name).family.ordered and not form.ordered:
            return f"{name} needs cameras in the order of time, but images are matched by name"
        if metric(name).timed and not form.timed:
            return f"{name} needs time stamps, which the files lack"
    return ""


def _stamps_or_path(frames: Any) -> FilePath | tuple[float, ...] | None:
    """Return time stamps as numbers that can be compared, and a path as it is."""
    if frames is None or isinstance(frames, (str, PathLike)):
        return frames
    with suppress(TypeError, ValueError):
        stamps = np.asarray(frames, dtype=np.float64)
        if stamps.ndim == 1 and len(stamps) and np.isfinite(stamps).all():
            return tuple(stamps.tolist())
    raise ValueError("frames must be a file, or finite time stamps, (k,)")


@cache
def options() -> dict[str, Option]:
    """Return what is known about each setting."""
    hints = get_type_hints(Settings, include_extras=True)
    return {
        name: about
        for name, hint in hints.items()
        for about in getattr(hint, "__metadata__", ())
        if isinstance(about, Option)
    }
