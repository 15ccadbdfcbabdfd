"""The settings of an evaluation: their names, defaults, bounds and help stand only here."""

import math
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches
from os import PathLike
from typing import Any

import numpy as np

from ..arrays import Floats
from ..extras import require
from ..io import FORMATS, FilePath, Format, parse_columns
from ..metrics import metric, split_names
from ..registration import REGISTRATIONS
from ..similarity import ALIGNMENTS, SYNONYMS, UP
from ..texts import brief, printable

__all__ = ["ABOUT", "SCORING", "Settings", "changed"]

# Groups in the help.
FILES, TIME, CONVENTIONS, SCORING = "files", "time", "conventions", "alignment and scores"


def _setting(default: Any, help: str, *, group: str = SCORING, **bounds: Any) -> Any:
    """Return a field of `Settings` whose values have a `number` type, or are texts or flags.

    `minimum` and `maximum` bound a number, `above` excludes its bound; `words` may stand instead,
    and `numbers`, such as "X,Y", says that there are several. `choices` are those of a text,
    `synonyms` what others call them. `needs` is what a format must have: time stamps (timed),
    topics or tables. None is a value where it is the default.
    """
    return field(default=default, metadata={"help": help, "group": group, **bounds})


def _file(default: Any, help: str, **bounds: Any) -> Any:
    return _setting(default, help, group=FILES, **bounds)


def _time(default: Any, help: str, **bounds: Any) -> Any:
    return _setting(default, help, group=TIME, **bounds)


def _convention(default: Any, help: str, **bounds: Any) -> Any:
    return _setting(default, help, group=CONVENTIONS, **bounds)


def _number(default: float | None, help: str, **bounds: Any) -> Any:
    return _setting(default, help, number=float, **bounds)


def _seconds(default: float | str | None, help: str, **bounds: Any) -> Any:
    return _time(default, help, number=float, needs="timed", **bounds)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How estimates are matched with their reference and scored.

    Each setting is an option of the command with the same name; ``docs/reference/command-line.md``
    lists them with their defaults. ``metrics`` may be one text, with commas between the names.

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

    format: str | None = _file(None, "format of the files", choices=tuple(FORMATS))
    est_format: str | None = _file(
        None, "format of the estimates, if it differs", choices=tuple(FORMATS)
    )
    ref_topic: str | None = _file(None, "topic of the reference in its bag", needs="topics")
    est_topic: str | None = _file(None, "topic of the estimates in their bags", needs="topics")
    columns: str | None = _file(
        None,
        "what the columns of text tables hold, such as 't x y z qx qy qz qw': t_ns for stamps in "
        "ns, n for frame numbers, r11 to r33 for matrices, - for other columns",
        needs="tables",
    )
    ref_columns: str | None = _file(None, "the same, only for the reference", needs="tables")
    # An estimate that is no table is refused where it is read: each has its own format.
    est_columns: str | None = _file(None, "the same, only for the estimates")
    model: str | None = _file(
        None,
        "model of an estimate that has several, such as 0 of sparse/0 and sparse/1 "
        "(default: the best one)",
    )
    missing: str = _time(
        "fail",
        "frames without a pose count as failures, or are ignored",
        choices=("fail", "ignore"),
    )
    t_max_diff: float = _seconds(
        0.01, "largest difference between matched time stamps, in s", minimum=0
    )
    sync: str = _time(
        "auto",
        "interpolate: compare a pose with the reference interpolated at its time; nearest: compare "
        "each reference pose with the nearest pose; auto: interpolate, unless the reference is too "
        "sparse",
        choices=("auto", "interpolate", "nearest"),
        needs="timed",
    )
    rate: float | str = _seconds(
        10.0,
        "expected frames a second, sampled from the reference; all: each of its poses",
        above=0,
        words=("all",),
    )
    max_gap: float = _seconds(
        2.0,
        "largest gap between two poses that is covered, in s: each pose covers half of it on "
        "either side, and the rest of a longer gap is lost; 0: each frame needs its own pose",
        minimum=0,
    )
    t_start: float | None = _seconds(None, "start of the expected frames, in s")
    t_end: float | None = _seconds(None, "end of the expected frames, in s")
    t_offset: float | str = _seconds(
        0.0,
        "added to the estimate's time stamps, in s; auto: found from the rotation rates, or "
        "without rotations from the speeds; 0 if it is not certain or costs score",
        words=("auto",),
    )
    frames: FilePath | Floats | tuple[float, ...] | None = _time(  # noqa: RUF009
        None,
        "time stamps of the expected frames, instead of --rate, in the first column of a text "
        "file, in s or ns like the estimate; for compare also a pattern with {sequence}",
        needs="timed",
    )
    invert: bool = _convention(False, "the estimates are world-to-camera: invert them")
    est_invert: bool = _convention(False, "the same as invert")
    ref_invert: bool = _convention(False, "the reference is world-to-camera: invert it")
    body_rotation: str = _convention(
        "none",
        "auto: remove a constant rotation of the camera frame, if one is detected",
        choices=("auto", "none"),
    )
    lever_arm: str | tuple[float, ...] | None = _convention(
        None,
        "X,Y,Z: position of the reference's prism or antenna in the estimate's body frame; auto: "
        "find it with the alignment",
        number=float,
        numbers="X,Y,Z",
        words=("auto",),
    )
    unit: float | None = _number(
        None, "d in the reference's unit (default: from the reference)", above=0
    )
    rig_frames: str = _setting(
        "auto",
        "images that d counts as one camera, at their mean position. auto: the frames of a COLMAP "
        "model, otherwise the same file name in different folders, if close together; none; the "
        "number of cameras of a rig, in consecutive rows; or a regular expression whose group is "
        r"the rig frame in the name, such as '(\d+)\.png$'",
    )
    max_threshold: float = _number(1.0, "largest threshold of the TAS in units of d", above=0)
    max_threshold_deg: float = _number(10.0, "largest threshold of the RAS in degrees", above=0)
    weight: float = _number(0.5, "share of the TAS in the PAS, from 0 to 1", minimum=0, maximum=1)
    registration: str = _setting(
        "refined",
        "refined: the alignment with the best TAS; pcr99: the paper's random one",
        choices=tuple(sorted(REGISTRATIONS)),
    )
    alignment: str = _setting(
        "similarity",
        "what the alignment of TAS, RAS and ATE removes. similarity, as in the paper: rotation, "
        "translation and scale; rigid: all but the scale; yaw: heading and translation; none: "
        "nothing",
        choices=ALIGNMENTS,
        synonyms=SYNONYMS,
    )
    up: str = _setting("z", "vertical axis, for --alignment yaw", choices=UP)
    reference_sigma: str | tuple[float, ...] | None = _setting(
        None,
        "X,DEG: standard deviations of the reference, of positions on each axis in its unit and "
        "of rotations about each axis; adds the score of a perfect estimate, and a note if the "
        "estimate is not distinguishable from it",
        number=float,
        numbers="X,DEG",
        minimum=0,
    )
    seed: int = _setting(
        0,
        "first seed of the registration, and the seed of errors, plots and saved files",
        number=int,
        minimum=0,
    )
    repeat: int = _setting(
        10,
        "number of seeds, from --seed on, over which pcr99 averages TAS and PAS; refined uses one, "
        "since it hardly depends on the seed",
        number=int,
        minimum=1,
    )
    metrics: tuple[str, ...] = _setting(
        (),
        "metrics by name, such as auc@30:vggt,rpe@1m, instead of the scores, for compare next to "
        "them; `alignscores metrics` lists all",
        group="output",
    )

    def __post_init__(self) -> None:
        values = {name: checked(name, getattr(self, name)) for name in ABOUT}
        for name in ("columns", "ref_columns", "est_columns"):
            if values[name] is not None:
                parse_columns(values[name])
        _check_rig_frames(self.rig_frames)
        values["invert"] = values["est_invert"] = values["invert"] or values["est_invert"]
        values["frames"] = _stamps_or_path(self.frames)
        names = split_names(self.metrics) if isinstance(self.metrics, str) else self.metrics
        if not isinstance(names, (list, tuple)) or not all(isinstance(name, str) for name in names):
            raise ValueError("metrics must be names; `evaluate` takes functions, too")
        metrics = {entry.name: entry for entry in map(metric, names)}
        if any("evo" in entry.needs for entry in metrics.values()):
            require("evo", "evo")
        values["metrics"] = tuple(metrics)
        for name, value in values.items():
            object.__setattr__(self, name, value)
        if self.up != Settings.up and self.alignment != "yaw":
            raise ValueError("up is used only by alignment=yaw: set that, too, or leave up out")
        if self.frames is not None and self.missing == "ignore":
            raise ValueError("frames without a pose fail: leave missing=ignore out, or frames")
        if self.frames is not None and self.t_offset == "auto":
            raise ValueError(
                "frames need t_offset in seconds: auto would move them with each estimate; give "
                "what it finds without frames"
            )
        if self.format:
            self._check_format()

    def to_dict(self) -> dict[str, Any]:
        """Return the settings as JSON has them; options that do not apply to the format are None.

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
        values = {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in vars(self).items()
            if name != "metrics"
        }
        if not self.file_format.timed:
            values |= {name: None for name in ABOUT if ABOUT[name].get("needs") == "timed"}
        if self.frames is not None:
            values["rate"] = None
        if isinstance(self.frames, (str, PathLike)):
            values["frames"] = printable(str(self.frames))
        values["est_format"] = self.est_format or self.format
        values["up"] = self.up if self.alignment == "yaw" else None
        values["repeat"] = len(self.seeds)
        return values

    def _check_format(self) -> None:
        """Check that the format has time stamps, topics and an order where settings need them."""
        for name, about in ABOUT.items():
            needs = about.get("needs")
            if needs is None or getattr(self, name) == getattr(Settings, name):
                continue
            if needs == "timed" and not self.file_format.timed:
                raise ValueError(f"{name} needs time stamps, which {self.format} files lack")
            if needs == "topics" and not (self.file_format.topics or self.est_file_format.topics):
                raise ValueError(f"{name} applies only to bags: {self.format} files have no topics")
            if needs == "tables" and not (self.file_format.tables or self.est_file_format.tables):
                raise ValueError(f"{name} applies only to text tables, not to {self.format} files")
        if self.file_format.ordered != self.est_file_format.ordered:
            names, others = self.est_format, self.format
            if self.est_file_format.ordered:
                names, others = others, names
            raise ValueError(
                f"{self.est_format} estimates cannot be matched to {self.format} references: only "
                f"{names} files have image names; write the poses of the {others} file as a table "
                "'name x y z qx qy qz qw'"
            )
        for name in self.metrics:
            if "order" in metric(name).needs and not self.file_format.ordered:
                raise ValueError(f"{name} needs the order of time, but images are matched by name")

    @property
    def seeds(self) -> range:
        """The seeds that are scored: a single one where the score hardly depends on it."""
        drawn = self.registration == "pcr99" and self.alignment != "none"
        repeat = self.repeat if drawn else 1
        return range(self.seed, self.seed + repeat)

    @property
    def frames_per_second(self) -> float:
        """Rate of the expected frames; infinite where each pose of the reference is one."""
        return math.inf if self.rate == "all" else float(self.rate)

    @property
    def tas_options(self) -> dict[str, Any]:
        """The options of `tas` that are the same for each seed and registration."""
        return {name: getattr(self, name) for name in ("max_threshold", "alignment", "up")}

    @property
    def how_aligned(self) -> str:
        """Alignment and registration, as tables and plots name them."""
        if self.alignment == "none":
            return "alignment: none"
        first, *others = self.seeds
        mean = f", mean over seeds {first} to {others[-1]}" if others else ""
        return f"alignment: {self.alignment} ({self.registration}{mean})"

    @property
    def file_format(self) -> Format:
        """The format of the files."""
        if self.format is None:
            raise ValueError(f"give the format of the files: format={'|'.join(FORMATS)}")
        return FORMATS[self.format]

    @property
    def est_file_format(self) -> Format:
        """The format of the estimates."""
        return FORMATS[self.est_format] if self.est_format else self.file_format

    @property
    def columns_of_reference(self) -> str | None:
        """The columns of the reference, if they are named."""
        return self.ref_columns or self.columns

    @property
    def columns_of_estimates(self) -> str | None:
        """The columns of the estimates, if they are named."""
        return self.est_columns or self.columns


# What is known about each setting, by name: help, group and bounds.
ABOUT: dict[str, Mapping[str, Any]] = {
    setting.name: setting.metadata for setting in fields(Settings)
}


def checked(name: str, value: Any) -> Any:
    """Return a valid value of a setting, also a number of its text, or raise a ValueError."""
    about, default = ABOUT[name], getattr(Settings, name)
    if (value is None and default is None) or name in ("frames", "metrics"):
        return value
    if isinstance(value, str) and value in about.get("words", ()):
        return value
    try:
        if choices := about.get("choices"):
            expected = f"one of {', '.join(choices)}"
            if isinstance(value, str) and value in choices:
                return value
        elif isinstance(default, bool):
            expected = "true or false"
            if isinstance(value, bool):
                return value
        elif "number" not in about:
            expected = "a text"
            if isinstance(value, str):
                return value
        elif names := about.get("numbers"):
            expected = f"{names}, each {_range(about)}"
            parts = value.split(",") if isinstance(value, str) else value
            numbers = tuple(_number_within(part, about) for part in parts)
            if len(numbers) == names.count(",") + 1:
                return numbers
        else:
            expected = _range(about)
            return _number_within(value, about)
    except (OverflowError, TypeError, ValueError):
        pass
    synonyms = f"; {about['synonyms']}" if "synonyms" in about else ""
    raise ValueError(f"{name} must be {expected}, not {brief(value)}{synonyms}")


def _number_within(value: Any, about: Mapping[str, Any]) -> float:
    """Return a number within its bounds, also of a text; raise an error of any other value."""
    of_text = isinstance(value, (str, int, np.integer)) and not isinstance(value, bool)
    fraction = isinstance(value, (float, np.floating)) and about["number"] is float
    if not (of_text or fraction):
        raise TypeError
    number: float = about["number"](value)
    minimum, above, maximum = (about.get(name) for name in ("minimum", "above", "maximum"))
    too_low = (minimum is not None and number < minimum) or (above is not None and number <= above)
    if not math.isfinite(number) or too_low or (maximum is not None and number > maximum):
        raise ValueError
    return number


def _range(about: Mapping[str, Any]) -> str:
    """Return which numbers a setting may have, and which words."""
    text = "a whole number" if about["number"] is int else "a finite number"
    if "above" in about:
        text += f" above {about['above']:g}"
    elif "maximum" in about:
        text += f" from {about['minimum']:g} to {about['maximum']:g}"
    elif "minimum" in about:
        text += f" of at least {about['minimum']:g}"
    return text + "".join(f" or {word}" for word in about.get("words", ()))


def _check_rig_frames(text: str) -> None:
    """Raise a ValueError for a text that is no word, number of cameras or regular expression."""
    if text in ("auto", "none") or (isinstance(text, str) and text.isdecimal() and int(text) > 1):
        return
    try:
        n_groups = re.compile(text).groups
    except (re.error, TypeError) as error:
        raise ValueError(f"rig_frames {brief(text)} is not a regular expression: {error}") from None
    if n_groups != 1:
        raise ValueError(
            r"rig_frames needs one group in brackets, as in '(\d+)\.png$', or a number of cameras"
        )


def _stamps_or_path(frames: Any) -> FilePath | tuple[float, ...] | None:
    """Return time stamps as numbers that can be compared, and a path as it is."""
    if frames is None or isinstance(frames, (str, PathLike)):
        return frames
    with suppress(TypeError, ValueError):
        stamps = np.asarray(frames, dtype=np.float64)
        if stamps.ndim == 1 and len(stamps) and np.isfinite(stamps).all():
            return tuple(stamps.tolist())
    raise ValueError("frames must be a file, or finite time stamps, (k,)")


def changed(settings: Settings, changes: Mapping[str, Any]) -> Settings:
    """Return settings with changes; a wrong name is answered with the nearest one."""
    if not isinstance(settings, Settings):
        raise TypeError(f"settings must be Settings, not {brief(settings)}")
    for name in changes:
        if name not in ABOUT:
            near = get_close_matches(name, ABOUT, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise TypeError(f"there is no setting {name!r}{hint}")
    return replace(settings, **changes)


def _documented(name: str) -> str:
    """Return a setting as a docstring describes it: its type, and its help."""
    about, default = ABOUT[name], getattr(Settings, name)
    text = "bool" if isinstance(default, bool) else "str"
    if choices := about.get("choices"):
        text = f"{{{', '.join(map(repr, choices))}}}"
    elif "number" in about and "numbers" not in about:
        text = about["number"].__name__
    text += "".join(f" or {word!r}" for word in about.get("words", ()))
    text += ", optional" if default is None else ""
    return f"    {name} : {text}\n        {about['help'][0].upper()}{about['help'][1:]}.\n"


# The help of each setting, for `help(Settings)` and the reference page.
Settings.__doc__ = f"{Settings.__doc__}".replace(
    "    Raises\n",
    f"    Parameters\n    ----------\n{''.join(map(_documented, ABOUT))}\n    Raises\n",
    1,
)
