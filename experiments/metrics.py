"""How trials evaluate the metrics of `alignscores.metrics` and the baselines of the paper.

Options of metrics are settings of a sweep, ``tas.max_threshold=0.5``. A table with several variants
of a metric has the options in the names of its columns: ``TAS(max_threshold=0.5)``.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, cached_property
from math import ceil, floor, inf, nan
from typing import Annotated, Any, Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic.dataclasses import dataclass as checked_dataclass

from alignscores import Similarity, ras, tas, tas_distance
from alignscores.arrays import Floats
from alignscores.histogram import equal_steps, score_of
from alignscores.metrics import metric, named
from alignscores.paper import literal_frames
from alignscores.protocols import PROTOCOLS, Family, Metric, NoValueError
from alignscores.protocols.families import find
from alignscores.registration import Registration, pcr99
from alignscores.thresholds import N_THRESHOLDS, smallest_unit
from alignscores.translation import closest_pair_quartile
from baselines import ate, dre, dte, maa, rotation_statistics
from baselines.averages import rotation_l1_means
from baselines.discernible import dte_of_stacks
from baselines.pairwise import Count, maa_by_counts
from baselines.rotation import aligned_angles, statistics_of_stacks

from .command import ConfigError, problems
from .scenes import Scene

__all__ = ["METRICS", "MOST", "Batch", "Column", "MetricOptions", "Options"]
__all__ += ["Positive", "TrialMetric", "evaluate", "evaluate_scenes"]


MOST = 10**6  # thresholds, hypotheses, cameras, trials of a cell; noise

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Whole = Annotated[int, Field(gt=0, le=MOST)]
PositiveOrInfinite = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(gt=0, le=1)]
RegistrationName = Literal["pcr99", "refined", "literal_frames"]


class Options(BaseModel):
    """The options of a metric; the defaults are the paper's values."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class MAAOptions(Options):
    """Thresholds of the mAA, whether the sign of a translation is ignored, and what is counted."""

    max_threshold_deg: Positive = 10.0
    n_thresholds: Whole = 100
    fold_sign: bool = False
    pooled: bool = False


class UnitOptions(Options):
    """How d is read: as one of the closest-pair distances, or interpolated between two."""

    interpolated: bool = False


class TASOptions(UnitOptions):
    """Unit, thresholds and registration of the TAS."""

    registration: RegistrationName = "pcr99"
    max_threshold: Positive = 1.0
    n_thresholds: Whole = 100
    quantile: Share = 0.75  # of the closest-pair distances: d
    n_hypotheses: Whole = 1000
    prescreen: PositiveOrInfinite = 0.1
    order: Share = 0.1  # of the cameras: m

    @model_validator(mode="after")
    def _others_have_no_options_of_pcr99(self) -> "TASOptions":
        if self.registration != "pcr99" and not self.is_papers_pcr99:
            raise ValueError("prescreen and order can be set for pcr99 alone")
        return self

    @property
    def is_papers_pcr99(self) -> bool:
        """Whether the options that only `pcr99` has are the paper's."""
        return (self.prescreen, self.order) == (0.1, 0.1)


class RASOptions(Options):
    """Thresholds of the RAS, and the average that the rotations are aligned by."""

    max_threshold_deg: Positive = 10.0
    n_thresholds: Whole = 100
    averaging: Literal["paper", "l1"] = "paper"


class PASOptions(Options):
    """Weight of the TAS in the PAS; the others default to the TAS's."""

    weight: Annotated[float, Field(ge=0, le=1)] = 0.5
    registration: RegistrationName | None = None
    interpolated: bool | None = None


class HalfAngleOptions(Options):
    """Score whose threshold is looked for; a quarter is reached with half of the cameras lost."""

    score: Share = 0.5


class HalfDistanceOptions(HalfAngleOptions):
    """The same, with the registration."""

    registration: RegistrationName = "refined"


@checked_dataclass(frozen=True, kw_only=True, config=ConfigDict(extra="forbid"))
class MetricOptions:
    """The options of all metrics that have some, by the metric's name in lower case."""

    tas: TASOptions = TASOptions()
    ras: RASOptions = RASOptions()
    pas: PASOptions = PASOptions()
    maa: MAAOptions = MAAOptions()
    half_distance: HalfDistanceOptions = HalfDistanceOptions()
    half_angle: HalfAngleOptions = HalfAngleOptions()
    d: UnitOptions = UnitOptions()


PAPER = MetricOptions()


@dataclass(frozen=True)
class TrialMetric:
    """What trials do with a metric; without a function, the family's for the estimated cameras."""

    family: Family
    function: Callable[["Batch", Any], ArrayLike] | None = None
    options: type[Options] = Options


@dataclass(frozen=True)
class Column:
    """A metric with options, as it heads a column of a table of trials."""

    name: str
    options: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    @cache
    def parse(cls, text: str) -> "Column":
        """Read a column's name; refuse an unknown metric, option or value."""
        name, bracket, inside = text.partition("(")
        try:
            fields = cls(name)._options.model_fields
        except ValueError as error:
            raise ConfigError(str(error)) from None
        pairs = inside.removesuffix(")").split(",") if bracket else []
        options = {}
        for pair in pairs:
            key, _, value = (part.strip() for part in pair.partition("="))
            if key not in fields or not inside.endswith(")"):
                choice = ", ".join(fields) or "none"
                raise ConfigError(
                    f"metric {text!r} has no option {key!r}; the options are {choice}"
                )
            options[key] = value
        column = cls(name, options)
        try:
            _ = column.values
        except ValidationError as error:
            key, problem = problems(error)[0]
            raise ConfigError(f"metric {text!r}: {f'{key} ' if key else ''}{problem}") from None
        return column

    def __str__(self) -> str:
        inside = ", ".join(f"{key}={value}" for key, value in self.options.items())
        return f"{self.name}({inside})" if inside else self.name

    def with_option(self, key: str, value: object) -> "Column":
        """Return the metric with one more option."""
        return Column(self.name, {**self.options, key: str(value)})

    @cached_property
    def metric(self) -> Metric:
        """What is known of it."""
        families = [entry.family for entry in METRICS.values()]
        return find(self.name, [*families, *PROTOCOLS])

    @property
    def values(self) -> Options:
        """The values of all options; those that are not given are the paper's."""
        return self.values_in(PAPER)

    def values_in(self, settings: MetricOptions) -> Options:
        """Return the values of all options; those that are not given are the sweep's."""
        shared = getattr(settings, self.metric.name.lower(), self._options())
        return self._options.model_validate({**shared.model_dump(), **self.options})

    @property
    def _options(self) -> type[Options]:
        entry = METRICS.get(self.metric.name)
        return entry.options if entry else Options


def evaluate(
    scene: Scene,
    metrics: Sequence[str],
    registration_seed: np.random.SeedSequence,
    settings: MetricOptions = PAPER,
) -> dict[str, float]:
    """Evaluate metrics on one scene; see `evaluate_scenes`."""
    values = evaluate_scenes([scene], [registration_seed], metrics, settings)
    return {metric: float(value) for metric, (value,) in values.items()}


def evaluate_scenes(
    scenes: Sequence[Scene],
    seeds: Sequence[np.random.SeedSequence],
    metrics: Sequence[str],
    settings: MetricOptions = PAPER,
) -> dict[str, Floats]:
    """Evaluate metrics on scenes, each registered with its own seed: a value a scene for each.

    Cameras that are missing in the estimate count as failures in TAS, RAS, PAS and mAA. ATE, DTE,
    DRE and the rotation statistics have no value for them and are evaluated on the other cameras
    alone, as is usual: losing bad cameras improves them. For protocols see
    docs/reference/protocols.md; NaN where one has no value.
    """
    batch = Batch(scenes, seeds, metrics, settings)
    return {metric: batch.values(metric) for metric in metrics}


class Batch:
    """Scenes under many metrics, which share what they have in common.

    There is one alignment for each choice of registration, and one set of errors, however many
    thresholds and weights these are scored with: metrics are compared on the same errors. No value
    depends on the other scenes.
    """

    def __init__(
        self,
        scenes: Sequence[Scene],
        seeds: Sequence[np.random.SeedSequence],
        metrics: Sequence[str],
        settings: MetricOptions,
    ) -> None:
        self.scenes, self.seeds, self.settings = scenes, seeds, settings
        columns = map(Column.parse, metrics)
        self._counts = [one.values_in(settings) for one in columns if one.metric.name == "mAA"]
        self._position_errors: dict[TASOptions, Sequence[Floats]] = {}

    def values(self, metric: str) -> Floats:
        """Evaluate a metric; NaN where a protocol has no value."""
        column = Column.parse(metric)
        entry = METRICS.get(column.metric.name)
        if entry and entry.function:
            return np.asarray(entry.function(self, column.values_in(self.settings)))
        values = np.full(len(self.scenes), nan)
        for i, (scene, seed) in enumerate(zip(self.scenes, self.seeds, strict=True)):
            with suppress(NoValueError):
                arrays = scene.estimated.arrays if entry else scene.arrays
                values[i] = column.metric(*arrays, rng=seed)
        return values

    def tas(self, options: TASOptions) -> Floats:
        """Score the position errors."""
        units = self.d(options.quantile, options.interpolated)
        errors = self._errors(options)
        return _scores(errors, units, options.max_threshold, options.n_thresholds)

    def ras(self, options: RASOptions) -> Floats:
        """Score the rotation errors."""
        errors = self._rotation_errors if options.averaging == "paper" else self._l1_errors
        units = np.ones(len(errors))
        return _scores(errors, units, options.max_threshold_deg, options.n_thresholds)

    def pas(self, options: PASOptions) -> Floats:
        """Weigh TAS and RAS."""
        arguments = options.model_dump(exclude={"weight"}, exclude_none=True)
        tas = TASOptions(**{**self.settings.tas.model_dump(), **arguments})
        return options.weight * self.tas(tas) + (1 - options.weight) * self.ras(self.settings.ras)

    def maa(self, options: MAAOptions) -> Floats:
        """Count the pairs."""
        return self._maa[options]

    @cached_property
    def _maa(self) -> dict[Options, Floats]:
        """The mAA in all ways that are asked for: the pairs are the same."""
        ways = list(dict.fromkeys(self._counts))
        counts = [Count(**way.model_dump()) for way in ways]
        areas = np.array([maa_by_counts(scene.cameras, counts) for scene in self.scenes])
        return dict(zip(ways, areas.T, strict=True))

    def half_distance(self, options: HalfDistanceOptions) -> list[float]:
        """Return the smallest units at which the TAS reaches one half, or another score."""
        return [
            tas_distance(
                scene.gt_positions,
                scene.est_positions,
                options.score,
                rng=seed,
                registration=options.registration,
            )
            for scene, seed in zip(self.scenes, self.seeds, strict=True)
        ]

    def half_angle(self, options: HalfAngleOptions) -> list[float]:
        """Return the smallest ranges at which the RAS reaches one half, or another score."""
        errors = map(np.sort, self._rotation_errors)
        return [smallest_unit(one, options.score, N_THRESHOLDS) for one in errors]

    def _errors(self, options: TASOptions) -> Sequence[Floats]:
        """Position errors under a registration, computed once for each."""
        key = _registered_alike(options)
        if key not in self._position_errors:
            self._position_errors[key] = self._align(key)
        return self._position_errors[key]

    def _align(self, options: TASOptions) -> Sequence[Floats]:
        register = _registration(options)
        units = self.d(options.quantile, options.interpolated)
        return [
            tas(
                scene.gt_positions,
                scene.est_positions,
                rng=seed,
                unit=unit,
                n_hypotheses=options.n_hypotheses,
                max_threshold=options.max_threshold,
                registration=register,
            ).errors
            for scene, seed, unit in zip(self.scenes, self.seeds, units, strict=True)
        ]

    def d(self, quantile: float = 0.75, interpolated: bool = False) -> Floats:
        """Return d of the paper for any quantile, an order statistic or between two."""
        d = np.quantile if interpolated else _order_statistic
        return np.array([d(distances, quantile) for distances in self._closest_pairs])

    @cached_property
    def _closest_pairs(self) -> list[Floats]:
        positions = [scene.gt_positions for scene in self.scenes]
        return [np.sort(scipy.spatial.KDTree(p).query(p, k=2)[0][:, 1]) for p in positions]

    @cached_property
    def _rotation_errors(self) -> list[Floats]:
        return [ras(scene.gt_rotations, scene.est_rotations).errors for scene in self.scenes]

    @cached_property
    def _l1_errors(self) -> list[Floats]:
        """Rotation errors after the geodesic L1 mean, in some order; infinite for missing ones."""
        errors = []
        for scene in self.scenes:
            gt, est = scene.estimated.gt_rotations, scene.estimated.est_rotations
            angles = aligned_angles(
                gt, est, rotation_l1_means((gt @ est.transpose(0, 2, 1))[None])[0]
            )
            n_missing = len(scene.gt_rotations) - len(angles)
            errors.append(np.append(angles, np.full(n_missing, inf)))
        return errors

    @cached_property
    def dte(self) -> Floats:
        """The DTE of the estimated cameras of each scene."""
        return self._in_stacks(lambda *world: {"": dte_of_stacks(*world)})[""]

    def dre(self) -> Floats:
        """Return the DRE of each."""
        return (self.rotation_statistics["Mean-1"] + self.rotation_statistics["RMS-1"]) / 2

    @cached_property
    def rotation_statistics(self) -> dict[str, Floats]:
        """Median, mean and RMS of the rotation errors of each, under both alignments."""
        return self._in_stacks(lambda _, gt, __, est: statistics_of_stacks(gt, est))

    def _in_stacks(self, function: Callable[..., Mapping[str, Floats]]) -> dict[str, Floats]:
        """Evaluate all scenes with the same number of estimated cameras at once."""
        cameras = [scene.estimated.arrays for scene in self.scenes]
        counts = np.array([len(positions) for positions, *_ in cameras])
        results: dict[str, Floats] = {}
        for count in np.unique(counts):
            scenes = np.flatnonzero(counts == count)
            stacks = map(np.stack, zip(*(cameras[scene] for scene in scenes), strict=True))
            for name, values in function(*stacks).items():
                results.setdefault(name, np.empty(len(counts)))[scenes] = values
        return results


def _registration(options: TASOptions) -> str | Registration:
    """Return the registration: the paper's with another prescreening threshold or another m."""
    if options.registration == "literal_frames":
        return literal_frames
    if options.is_papers_pcr99:
        return options.registration

    def register(
        gt: Floats, est: Floats, /, *, rank: int, **settings: Any
    ) -> tuple[Similarity | None, int]:
        m = max(4, floor(_exact(options.order * len(gt)) + 0.5))
        return pcr99(gt, est, rank=min(m, len(gt)), prescreen=options.prescreen, **settings)

    return register


@cache
def _registered_alike(options: TASOptions) -> TASOptions:
    """Return the same options for all that have one alignment."""
    # PCR-99 knows nothing of unit and thresholds, whatever they are.
    other: dict[str, float] = {"n_thresholds": 100}
    if options.registration != "refined":
        other |= {"max_threshold": 1.0, "quantile": 0.75, "interpolated": False}
    return options.model_copy(update=other)


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


def _ates(batch: Batch, _: Options) -> list[float]:
    scenes = [scene.estimated for scene in batch.scenes]
    return [ate(scene.gt_positions, scene.est_positions) for scene in scenes]


def _statistic(name: str, alignment: str) -> TrialMetric:
    return TrialMetric(
        named(
            name,
            f"{name[:-2]} of the rotation errors after an {alignment} alignment",
            lambda gt, est: rotation_statistics(gt[:, :, :3], est[:, :, :3])[name],
            "refused",
            unit="deg",
        ),
        lambda batch, _: batch.rotation_statistics[name],
    )


_DRE = named(
    "DRE",
    "discernible rotation error",
    lambda gt, est: dre(gt[:, :, :3], est[:, :, :3]),
    "refused",
    unit="deg",
)
_MAA = named("mAA", "mean average accuracy of pairs", maa, "fail", larger_is_better=True)
_UNIT = named(
    "d",
    "the unit of the TAS",
    lambda gt, _: closest_pair_quartile(gt),
    "left out",
    unit="units",
    rotations=False,
)
_TRIAL_METRICS = (
    TrialMetric(metric("ATE").family, _ates),
    TrialMetric(
        named("DTE", "discernible trajectory error", dte, "refused"),
        lambda batch, _: batch.dte,
    ),
    TrialMetric(_MAA, Batch.maa, MAAOptions),
    TrialMetric(metric("TAS").family, Batch.tas, TASOptions),
    TrialMetric(metric("RAS").family, Batch.ras, RASOptions),
    TrialMetric(metric("PAS").family, Batch.pas, PASOptions),
    TrialMetric(metric("half_distance").family, Batch.half_distance, HalfDistanceOptions),
    TrialMetric(metric("half_angle").family, Batch.half_angle, HalfAngleOptions),
    TrialMetric(_DRE, lambda batch, _: batch.dre()),
    *(_statistic(f"{name}-1", "L1") for name in ("Median", "Mean", "RMS")),
    *(_statistic(f"{name}-2", "L2") for name in ("Median", "Mean", "RMS")),
    TrialMetric(
        _UNIT, lambda batch, options: batch.d(interpolated=options.interpolated), UnitOptions
    ),
)
METRICS: Mapping[str, TrialMetric] = {entry.family.example: entry for entry in _TRIAL_METRICS}
"""All metrics but the protocols by their names. To add one, add its entry above."""
