"""What a trial evaluates: `METRICS`, one table of functions, and the library's other metrics.

A function takes `Trials` and, as keyword arguments, the options of the metric with the paper's
values. Options are settings of a sweep, ``tas.max_threshold=0.5``, or stand in the name of a
column, ``TAS(max_threshold=0.5)``.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from inspect import Parameter, signature
from math import ceil, floor, inf, nan
from typing import Annotated, Any, Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    PlainSerializer,
    ValidationError,
    create_model,
    model_validator,
)
from pydantic.dataclasses import dataclass as checked_dataclass

from alignscores import Similarity, tas, tas_distance
from alignscores import metrics as library
from alignscores.arrays import Floats
from alignscores.histogram import equal_steps, score_of
from alignscores.metrics import Metric, NoValueError
from alignscores.metrics.base import find
from alignscores.paper import literal_frames
from alignscores.registration import Registration, pcr99
from alignscores.rotation import align_rotations
from alignscores.thresholds import N_THRESHOLDS, smallest_unit
from alignscores.translation import closest_pair_quartile
from alignscores.validation import check_rotations
from baselines import ate, dte, maa, rotation_statistics
from baselines.averages import rotation_l1_means
from baselines.rotation import aligned_angles

from .command import ConfigError, problems
from .scenes import Scene

__all__ = ["METRICS", "MOST", "MetricOptions", "Positive", "Trials", "evaluate", "evaluate_scenes"]
__all__ += ["metric", "option_names", "split_options", "with_options"]


MOST = 10**6  # thresholds, hypotheses, cameras, trials of a cell; noise

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Whole = Annotated[int, Field(gt=0, le=MOST)]
PositiveOrInfinite = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(gt=0, le=1)]
Weight = Annotated[float, Field(ge=0, le=1)]
RegistrationName = Literal["pcr99", "refined", "literal_frames"]


@dataclass(frozen=True, eq=False)
class Trials:
    """The scenes of one batch, with what several metrics share.

    There is one alignment for each choice of registration, and one set of errors, however many
    thresholds and weights these are scored with: metrics are compared on the same errors. No value
    depends on the other scenes.

    Parameters
    ----------
    scenes : sequence of Scene
        Ground truth and estimate of each trial.
    seeds : sequence of SeedSequence
        Seed of the registration of each.
    columns : sequence of str
        All metrics that are asked for.
    settings : MetricOptions
        Options of the sweep.
    """

    scenes: Sequence[Scene]
    seeds: Sequence[np.random.SeedSequence]
    columns: Sequence[str]
    settings: "MetricOptions"
    _shared: dict[Hashable, Any] = field(default_factory=dict)

    def values(self, column: str) -> Floats:
        """Evaluate a metric: a value a scene, NaN where a metric of the library has none."""
        entry = metric(column)
        if METRICS.get(entry.name) is entry:
            return np.asarray(entry.function(self, **self.options(column)))
        values = np.full(len(self.scenes), nan)
        for i, scene in enumerate(self.scenes):
            with suppress(NoValueError):
                values[i] = entry(scene.gt_poses, scene.est_poses)
        return values

    def options(self, column: str) -> dict[str, Any]:
        """Return the options of a metric; those that its name does not set are the sweep's."""
        entry = metric(column)
        shared = getattr(self.settings, entry.name.lower(), {})
        return _checked(entry.function, {**shared, **split_options(column)[1]})

    def share(self, key: Hashable, compute: Callable[[], Any]) -> Any:
        """Return what is computed once for all metrics that share a key."""
        if key not in self._shared:
            self._shared[key] = compute()
        return self._shared[key]

    def in_stacks(
        self, function: Callable[[Floats, Floats], ArrayLike], *, estimated: bool = True
    ) -> Floats:
        """Evaluate a function of stacks of poses: at once of all scenes with as many cameras.

        Of the estimated cameras only, or of all.
        """
        scenes = [scene.estimated if estimated else scene for scene in self.scenes]
        counts = np.array([len(scene.gt_positions) for scene in scenes])
        values: list[Any] = [None] * len(scenes)
        for count in np.unique(counts):
            rows = np.flatnonzero(counts == count)
            gt = np.stack([scenes[row].gt_poses for row in rows])
            est = np.stack([scenes[row].est_poses for row in rows])
            for row, value in zip(rows, np.asarray(function(gt, est)), strict=True):
                values[row] = value
        return np.array(values)


def evaluate(
    scene: Scene,
    metrics: Sequence[str],
    registration_seed: np.random.SeedSequence,
    settings: "MetricOptions | None" = None,
) -> dict[str, float]:
    """Evaluate metrics on one scene; see `evaluate_scenes`."""
    values = evaluate_scenes([scene], [registration_seed], metrics, settings)
    return {column: float(value) for column, (value,) in values.items()}


def evaluate_scenes(
    scenes: Sequence[Scene],
    seeds: Sequence[np.random.SeedSequence],
    metrics: Sequence[str],
    settings: "MetricOptions | None" = None,
) -> dict[str, Floats]:
    """Evaluate metrics on scenes, each registered with its own seed: a value a scene for each.

    Cameras that are missing in the estimate count as failures in TAS, RAS, PAS and mAA. ATE, DTE,
    DRE and the rotation statistics have no value for them and are evaluated only on the other
    cameras, as is usual: losing bad cameras improves them. For other projects' metrics see
    docs/reference/metrics.md; NaN where one has no value.
    """
    trials = Trials(scenes, seeds, metrics, settings or MetricOptions())
    return {column: trials.values(column) for column in metrics}


# The functions of the table.


def _ate(trials: Trials) -> Floats:
    return trials.in_stacks(lambda gt, est: ate(gt[..., 3], est[..., 3]))


def _dte(trials: Trials) -> Floats:
    return trials.in_stacks(dte)


def _maa(
    trials: Trials,
    *,
    max_threshold_deg: Positive = 10.0,
    n_thresholds: Whole = 100,
    fold_sign: bool = False,
    pooled: bool = False,
) -> Floats:
    """Count the pairs, once for all columns of the mAA: most of the time goes into the errors."""
    asked = (max_threshold_deg, n_thresholds, fold_sign, pooled)
    columns = [column for column in trials.columns if metric(column).name == "mAA"]
    ways = dict.fromkeys([tuple(trials.options(column).values()) for column in columns])
    names = ("max_threshold_deg", "n_thresholds", "fold_sign", "pooled")
    options = dict(zip(names, map(list, zip(*ways, strict=True)), strict=True))
    areas = trials.share(
        "mAA",
        lambda: trials.in_stacks(lambda gt, est: maa(gt, est, **options), estimated=False),
    )
    return np.asarray(areas[:, list(ways).index(asked)])


def _tas(
    trials: Trials,
    *,
    registration: RegistrationName = "pcr99",
    max_threshold: Positive = 1.0,
    n_thresholds: Whole = 100,
    quantile: Share = 0.75,  # of the closest-pair distances: d
    interpolated: bool = False,
    n_hypotheses: Whole = 1000,
    prescreen: PositiveOrInfinite = 0.1,
    order: Share = 0.1,  # of the cameras: m
) -> Floats:
    """Score the position errors, computed once for all columns that are registered alike."""
    units = _d(trials, quantile=quantile, interpolated=interpolated)
    register = _registration(registration, prescreen, order)
    # PCR-99 does not depend on the unit and the thresholds.
    thresholds = (max_threshold, quantile, interpolated) if registration == "refined" else ()
    errors = trials.share(
        ("position errors", registration, n_hypotheses, prescreen, order, *thresholds),
        lambda: [
            tas(
                scene.gt_positions,
                scene.est_positions,
                rng=seed,
                unit=unit,
                n_hypotheses=n_hypotheses,
                max_threshold=max_threshold,
                registration=register,
            ).errors
            for scene, seed, unit in zip(trials.scenes, trials.seeds, units, strict=True)
        ],
    )
    return _scores(errors, units, max_threshold, n_thresholds)


def _ras(
    trials: Trials,
    *,
    max_threshold_deg: Positive = 10.0,
    n_thresholds: Whole = 100,
    averaging: Literal["paper", "l1"] = "paper",  # that the rotations are aligned by
) -> Floats:
    errors = _rotation_errors(trials) if averaging == "paper" else _l1_errors(trials)
    return _scores(errors, np.ones(len(errors)), max_threshold_deg, n_thresholds)


def _pas(
    trials: Trials,
    *,
    weight: Weight = 0.5,
    registration: RegistrationName | None = None,  # by default the TAS's
    interpolated: bool | None = None,
) -> Floats:
    options = {"registration": registration, "interpolated": interpolated}
    chosen = {key: value for key, value in options.items() if value is not None}
    of_tas = trials.settings.tas | chosen
    return weight * _tas(trials, **of_tas) + (1 - weight) * _ras(trials, **trials.settings.ras)


def _half_distance(
    trials: Trials, *, score: Share = 0.5, registration: RegistrationName = "refined"
) -> list[float]:
    """Return the smallest units at which the TAS reaches a score; 0.25 bears half of all lost."""
    register = _registration(registration)
    return [
        tas_distance(
            scene.gt_positions, scene.est_positions, score, rng=seed, registration=register
        )
        for scene, seed in zip(trials.scenes, trials.seeds, strict=True)
    ]


def _half_angle(trials: Trials, *, score: Share = 0.5) -> list[float]:
    """Return the smallest ranges of thresholds at which the RAS reaches a score."""
    errors = map(np.sort, _rotation_errors(trials))
    return [smallest_unit(angles, score, N_THRESHOLDS) for angles in errors]


def _dre(trials: Trials) -> Floats:
    """Return `baselines.dre`, from the statistics that it has in common with others."""
    return (_statistic(trials, name="Mean-1") + _statistic(trials, name="RMS-1")) / 2


def _statistic(trials: Trials, *, name: str) -> Floats:
    def values(gt: Floats, est: Floats) -> Floats:
        statistics = rotation_statistics(gt[..., :3], est[..., :3])
        return np.stack([statistics[name] for name in STATISTICS], axis=1)

    shared = trials.share("rotation statistics", lambda: trials.in_stacks(values))
    return np.asarray(shared[:, STATISTICS.index(name)])


def _d(trials: Trials, *, quantile: Share = 0.75, interpolated: bool = False) -> Floats:
    """Return d: a quantile of the closest-pair distances, one of them or between two."""
    positions = [scene.gt_positions for scene in trials.scenes]
    if (quantile, interpolated) == (0.75, False):
        d = trials.share("d", lambda: [closest_pair_quartile(gt) for gt in positions])
        return np.array(d)
    read = np.quantile if interpolated else _order_statistic
    distances = trials.share("closest pairs", lambda: list(map(_closest_pairs, positions)))
    return np.array([read(closest, quantile) for closest in distances])


def _closest_pairs(positions: Floats) -> Floats:
    """Return the distances to the closest other camera, in ascending order."""
    return np.sort(scipy.spatial.KDTree(positions).query(positions, k=2)[0][:, 1])


def _rotation_errors(trials: Trials) -> list[Floats]:
    """Return the errors of the RAS: all rotations are checked at once."""

    def compute() -> list[Floats]:
        pairs = [(scene.gt_rotations, scene.est_rotations) for scene in trials.scenes]
        gt, est = map(np.concatenate, zip(*pairs, strict=True))
        check_rotations(gt, "gt_rotations", complete=True)
        check_rotations(est, "est_rotations", complete=False)
        return [align_rotations(*pair)[1] for pair in pairs]

    errors: list[Floats] = trials.share("rotation errors", compute)
    return errors


def _l1_errors(trials: Trials) -> list[Floats]:
    """Return rotation errors after the geodesic L1 mean, in some order; infinite where missing."""
    errors = []
    for scene in trials.scenes:
        gt, est = scene.estimated.gt_rotations, scene.estimated.est_rotations
        (mean,) = rotation_l1_means((gt @ est.transpose(0, 2, 1))[None])
        angles = aligned_angles(gt, est, mean)
        n_missing = len(scene.gt_rotations) - len(angles)
        errors.append(np.append(angles, np.full(n_missing, inf)))
    return errors


def _registration(name: str, prescreen: float = 0.1, order: float = 0.1) -> str | Registration:
    """Return the registration: the paper's with another prescreening threshold or another m."""
    if name == "literal_frames":
        return literal_frames
    if name != "pcr99" or (prescreen, order) == (0.1, 0.1):
        return name

    def register(
        gt: Floats, est: Floats, /, *, rank: int, **settings: Any
    ) -> tuple[Similarity | None, int]:
        m = max(4, floor(_exact(order * len(gt)) + 0.5))
        return pcr99(gt, est, rank=min(m, len(gt)), prescreen=prescreen, **settings)

    return register


def _scores(
    errors: Sequence[Floats], units: Floats, max_threshold: float, n_thresholds: int
) -> Floats:
    """Score the errors of each scene."""
    steps = equal_steps(max_threshold, n_thresholds, "max_threshold")
    pairs = zip(errors, units, strict=True)
    return np.array([score_of(values, unit * steps) for values, unit in pairs])


def _order_statistic(ascending: Floats, quantile: float) -> float:
    """Return the ceil(q n)-th smallest of n values in ascending order."""
    return float(ascending[ceil(_exact(quantile * len(ascending))) - 1])


def _exact(product: float) -> float:
    """Take the rounding error off a share of a number: 0.07 of 100 is 7, not a little more."""
    return round(product, 9)


STATISTICS = ("Median-1", "Mean-1", "RMS-1", "Median-2", "Mean-2", "RMS-2")


def _of_library(name: str, function: Callable[..., Any]) -> Metric:
    """Return a metric of the library as trials evaluate it."""
    return replace(library.metric(name), function=function)


METRICS: Mapping[str, Metric] = {
    entry.name: entry
    for entry in (
        _of_library("ATE", _ate),
        Metric("DTE", _dte, description="discernible trajectory error"),
        Metric("mAA", _maa, larger_is_better=True, description="mean average accuracy of pairs"),
        _of_library("TAS", _tas),
        _of_library("RAS", _ras),
        _of_library("PAS", _pas),
        _of_library("half_distance", _half_distance),
        _of_library("half_angle", _half_angle),
        Metric("DRE", _dre, unit="deg", description="discernible rotation error"),
        *(
            Metric(name, partial(_statistic, name=name), unit="deg", description="rotation errors")
            for name in STATISTICS
        ),
        Metric("d", _d, unit="units", description="the unit of the TAS"),
    )
}
"""All metrics but other projects' by their names. To add one, write its function and its entry."""


# Options: read from names and settings, checked by the annotations of the functions.


class _Options(BaseModel):
    model_config = ConfigDict(extra="forbid")

    @model_validator(mode="after")
    def _others_have_no_options_of_pcr99(self) -> "_Options":
        values = dict(self)
        of_pcr99 = values.get("prescreen", 0.1), values.get("order", 0.1)
        if values.get("registration") in ("refined", "literal_frames") and of_pcr99 != (0.1, 0.1):
            raise ValueError("prescreen and order can be set only for pcr99")
        return self


@cache
def _model(function: Callable[..., Any]) -> type[_Options]:
    """Return the options of a metric, the keyword arguments of its function, as a model."""
    if isinstance(function, partial):  # which has set them
        return _Options
    fields: dict[str, Any] = {
        option.name: (option.annotation, option.default)
        for option in signature(function).parameters.values()
        if option.kind is Parameter.KEYWORD_ONLY
    }
    return create_model("Options", __base__=_Options, **fields)


def _checked(function: Callable[..., Any], options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of all options of a metric; a wrong one is a `ValidationError`."""
    return dict(_model(function).model_validate(options))


def option_names(name: str) -> list[str]:
    """Return the names of a metric's options."""
    return list(_model(METRICS[name].function).model_fields)


@dataclass(frozen=True)
class _OptionsOf:
    """Has pydantic check a setting as the options of a function."""

    function: Callable[..., Any]

    def __get_pydantic_core_schema__(self, _: Any, handler: GetCoreSchemaHandler) -> Any:
        model = _model(self.function)
        return handler.generate_schema(
            Annotated[model, AfterValidator(dict), PlainSerializer(dict)]
        )


def _defaults(function: Callable[..., Any]) -> Any:
    return field(default_factory=partial(_checked, function, {}))


@checked_dataclass(frozen=True, kw_only=True, config=ConfigDict(extra="forbid"))
class MetricOptions:
    """The options of all metrics that have some, by the metric's name in lower case."""

    tas: Annotated[dict[str, Any], _OptionsOf(_tas)] = _defaults(_tas)
    ras: Annotated[dict[str, Any], _OptionsOf(_ras)] = _defaults(_ras)
    pas: Annotated[dict[str, Any], _OptionsOf(_pas)] = _defaults(_pas)
    maa: Annotated[dict[str, Any], _OptionsOf(_maa)] = _defaults(_maa)
    half_distance: Annotated[dict[str, Any], _OptionsOf(_half_distance)] = _defaults(_half_distance)
    half_angle: Annotated[dict[str, Any], _OptionsOf(_half_angle)] = _defaults(_half_angle)
    d: Annotated[dict[str, Any], _OptionsOf(_d)] = _defaults(_d)


def split_options(column: str) -> tuple[str, dict[str, str]]:
    """Split a column, ``TAS(order=0.2)``, into the name of the metric and its options."""
    name, bracket, inside = column.partition("(")
    if not bracket:
        return name, {}
    if not inside.endswith(")"):
        raise ConfigError(f"metric {column!r} has no closing bracket")
    pairs = (pair.partition("=") for pair in inside.removesuffix(")").split(","))
    return name, {key.strip(): value.strip() for key, _, value in pairs}


def with_options(name: str, options: Mapping[str, Any]) -> str:
    """Return the column of a metric with options."""
    inside = ", ".join(f"{key}={value}" for key, value in options.items())
    return f"{name}({inside})" if inside else name


@cache
def metric(column: str) -> Metric:
    """Return the metric of a column; an unknown one, option or value is a `ConfigError`."""
    name, options = split_options(column)
    try:
        which = f"a sweep has {', '.join(METRICS)}, and those that `alignscores metrics` lists"
        entry = find(name, [*METRICS.values(), *library.METRICS], which)
    except ValueError as error:
        raise ConfigError(str(error)) from None
    allowed = _model(entry.function).model_fields if METRICS.get(entry.name) is entry else {}
    for key in options:
        if key not in allowed:
            choice = ", ".join(allowed) or "none"
            raise ConfigError(f"metric {column!r} has no option {key!r}; the options are {choice}")
    if allowed:
        try:
            _checked(entry.function, options)
        except ValidationError as error:
            key, problem = problems(error)[0]
            raise ConfigError(f"metric {column!r}: {f'{key} ' if key else ''}{problem}") from None
    return entry
