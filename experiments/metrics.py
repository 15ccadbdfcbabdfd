"""How trials evaluate the metrics of `alignscores.metrics` and those of the paper beside them.

A column of a table of trials is a metric by its name, possibly with options that differ from the
paper's values: ``TAS(max_threshold=0.5)``. This module alone reads and writes options.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from math import ceil, floor, inf, nan
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

from alignscores import (
    AlignmentScore,
    ScoreProfile,
    Similarity,
    ras_batch,
    ras_profile,
    tas,
    tas_distance,
)
from alignscores.arrays import Floats
from alignscores.histogram import equal_steps
from alignscores.metrics import metric, named
from alignscores.protocols import PROTOCOLS, Family, Metric, NoValueError
from alignscores.protocols.families import find
from alignscores.registration import Registration, pcr99
from alignscores.translation import closest_pair_distances, closest_pair_quartile
from baselines import ate, dre, dte, literal_frames, maa, rotation_statistics
from baselines.averages import rotation_l1_mean
from baselines.discernible import dre_of_stacks, dte_of_stacks
from baselines.pairwise import Count, maa_by_counts
from baselines.rotation import aligned_angles, statistics_of_stacks

from .command import ConfigError, problems
from .scenes import Scene

__all__ = ["LARGEST", "METRICS", "MOST", "Column", "Evaluation", "Options", "Positive", "Scenes"]
__all__ += ["TrialMetric", "evaluate"]


LARGEST = 1e100  # noise, length or volume: they are squared, and a double ends at 1e308
MOST = 10**6  # thresholds, hypotheses, cameras, or trials of a cell

Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False)]
Whole = Annotated[int, Field(gt=0, le=MOST)]
PositiveOrInfinite = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(gt=0, le=1)]
Seed = Annotated[int, Field(ge=0)]


def _count_or_infinite(value: float) -> float:
    if value <= 0 or not (value == inf or (value.is_integer() and value <= MOST)):
        raise ValueError(f"must be a whole number from 1 to {MOST}, or inf, not {value:g}")
    return value


# With infinitely many thresholds the staircase is a straight line, and the area under it exact.
CountOrInfinite = Annotated[float, AfterValidator(_count_or_infinite)]
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


class AlignmentOptions(UnitOptions):
    """How the estimate is registered; `seed` is of the registration, beside that of the trial."""

    registration: RegistrationName = "pcr99"
    seed: Seed | None = None


class TASOptions(AlignmentOptions):
    """Unit, thresholds and registration of the TAS."""

    max_threshold: Positive = 1.0
    n_thresholds: CountOrInfinite = 100
    quantile: Share = 0.75  # of the closest-pair distances: d
    n_hypotheses: Whole = 1000
    prescreen: PositiveOrInfinite = 0.1
    order: Share = 0.1  # of the cameras: m

    @model_validator(mode="after")
    def _others_have_no_options_of_pcr99(self) -> "TASOptions":
        given = {"prescreen", "order"} & self.model_fields_set
        if self.registration != "pcr99" and given:
            raise ValueError(f"{' and '.join(sorted(given))} can be set for pcr99 alone")
        return self


class RASOptions(Options):
    """Thresholds of the RAS, and the average that the rotations are aligned by."""

    max_threshold_deg: Positive = 10.0
    n_thresholds: CountOrInfinite = 100
    averaging: Literal["paper", "l1"] = "paper"


class PASOptions(AlignmentOptions):
    """Weight of the TAS in the PAS, and registration."""

    weight: Annotated[float, Field(ge=0, le=1)] = 0.5


class HalfAngleOptions(Options):
    """Score whose threshold is looked for; a quarter is reached with half of the cameras lost."""

    score: Share = 0.5


class HalfDistanceOptions(HalfAngleOptions):
    """The same, with the registration."""

    registration: RegistrationName = "refined"
    seed: Seed | None = None


@dataclass(frozen=True)
class TrialMetric:
    """What trials do with a metric; without a function, the family's for the estimated cameras."""

    family: Family
    function: Callable[["Evaluation", Any], float] | None = None
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
            known = cls(name)._options.model_fields
        except ValueError as error:
            raise ConfigError(str(error)) from None
        pairs = inside.removesuffix(")").split(",") if bracket else []
        options = {}
        for pair in pairs:
            key, _, value = (part.strip() for part in pair.partition("="))
            if key not in known or not inside.endswith(")"):
                choice = ", ".join(known) or "none"
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

    @cached_property
    def values(self) -> Options:
        """The values of all options."""
        return self._options.model_validate(dict(self.options))

    @property
    def _options(self) -> type[Options]:
        entry = METRICS.get(self.metric.name)
        return entry.options if entry else Options


def evaluate(
    scene: Scene, metrics: Sequence[str], registration_seed: np.random.SeedSequence
) -> dict[str, float]:
    """Evaluate metrics on a scene; all random registrations have the same seed.

    Cameras that are missing in the estimate count as failures in TAS, RAS, PAS and mAA. ATE, DTE,
    DRE and the rotation statistics have no value for them and are evaluated on the other cameras
    alone, as is usual: losing bad cameras improves them. For protocols see
    docs/reference/protocols.md; NaN where one has no value.
    """
    columns = {metric: Column.parse(metric) for metric in metrics}
    evaluation = Evaluation(scene, registration_seed, columns.values())
    return {metric: evaluation.value(column) for metric, column in columns.items()}


class Scenes:
    """Scenes side by side: what takes NumPy longer for one after the other, in the same bits."""

    def __init__(self, scenes: Sequence[Scene]) -> None:
        self.scenes = scenes

    @cached_property
    def rotation_errors(self) -> list[Floats]:
        """Return the errors that the RAS of each scene counts."""
        found = ras_batch(
            [scene.gt_rotations for scene in self.scenes],
            [scene.est_rotations for scene in self.scenes],
        )
        return np.split(found.errors, found.starts[1:-1])

    @cached_property
    def dte(self) -> Floats:
        """Return the DTE of the estimated cameras of each scene."""
        return self._in_stacks(lambda *world: {"": dte_of_stacks(*world)})[""]

    @cached_property
    def dre(self) -> Floats:
        """Return the DRE of each."""
        return self._in_stacks(lambda _, gt, __, est: {"": dre_of_stacks(gt, est)})[""]

    @cached_property
    def rotation_statistics(self) -> dict[str, Floats]:
        """Return median, mean and RMS of the rotation errors of each, under both alignments."""
        return self._in_stacks(lambda _, gt, __, est: statistics_of_stacks(gt, est))

    def _in_stacks(self, function: Callable[..., Mapping[str, Floats]]) -> dict[str, Floats]:
        """Have values found for all scenes with the same number of estimated cameras at once."""
        cameras = [scene.estimated.arrays for scene in self.scenes]
        counts = np.array([len(positions) for positions, *_ in cameras])
        found: dict[str, Floats] = {}
        for count in np.unique(counts):
            places = np.flatnonzero(counts == count)
            stacks = map(np.stack, zip(*(cameras[place] for place in places), strict=True))
            for name, values in function(*stacks).items():
                found.setdefault(name, np.empty(len(counts)))[places] = values
        return found


class Evaluation:
    """One scene under many metrics, which share what they have in common.

    There is one alignment for each choice of registration, and one set of errors, however many
    thresholds and weights these are scored with: metrics are compared on the same errors. The
    `columns` are those that will be asked for, as far as they are known: the mAA with several
    options takes less time at once. So do scenes side by side: those `beside` it, of which it is at
    a `place`.
    """

    def __init__(
        self,
        scene: Scene,
        registration_seed: np.random.SeedSequence,
        columns: Iterable[Column] = (),
        *,
        beside: Scenes | None = None,
        place: int = 0,
    ) -> None:
        self.scene = scene
        self.beside, self.place = beside or Scenes([scene]), place
        self._seed = registration_seed
        self._counts = [column.values for column in columns if column.metric.name == "mAA"]
        self._maa: dict[Options, float] = {}
        self._position_errors: dict[TASOptions, Floats] = {}

    def value(self, column: Column) -> float:
        """Evaluate a metric; NaN where a protocol has no value."""
        entry = METRICS.get(column.metric.name)
        if entry and entry.function:
            return entry.function(self, column.values)
        scene = self.scene.estimated if entry else self.scene
        try:
            return column.metric(*scene.arrays, rng=self._seed)
        except NoValueError:
            return nan

    def tas(self, options: TASOptions) -> float:
        """Score the position errors."""
        errors = self._errors(options)
        unit = self._unit(options.quantile, options.interpolated)
        return _score(errors, unit, options.max_threshold, options.n_thresholds)

    def ras(self, options: RASOptions) -> float:
        """Score the rotation errors."""
        errors = self._rotation_errors if options.averaging == "paper" else self._l1_errors
        return _score(errors, 1.0, options.max_threshold_deg, options.n_thresholds)

    def pas(self, options: PASOptions) -> float:
        """Weigh TAS and RAS."""
        weight = options.weight
        return weight * self.tas(_of_tas(options)) + (1 - weight) * self.ras(RASOptions())

    def maa(self, options: MAAOptions) -> float:
        """Count the pairs, in all ways that will be asked for at once."""
        if options not in self._maa:
            ways = list(dict.fromkeys([options, *self._counts]))
            counts = [Count(**way.model_dump()) for way in ways]
            found = maa_by_counts(self.scene.cameras, counts)
            self._maa.update(zip(ways, found, strict=True))
        return self._maa[options]

    def half_distance(self, options: HalfDistanceOptions) -> float:
        """Return the smallest unit at which the TAS reaches one half, or another score."""
        scene = self.scene
        return tas_distance(
            scene.gt_positions,
            scene.est_positions,
            options.score,
            rng=self._registration_seed(options.seed),
            registration=options.registration,
        )

    def half_angle(self, options: HalfAngleOptions) -> float:
        """Return the smallest range at which the RAS reaches one half, or another score."""
        return self._rotation_profile.unit_at(options.score)

    @cached_property
    def _rotation_profile(self) -> ScoreProfile:
        return ras_profile(self.scene.gt_rotations, self.scene.est_rotations, [10.0])

    def _errors(self, options: TASOptions) -> Floats:
        """Position errors under a registration, computed once for each."""
        key = _registered_alike(options)
        if key not in self._position_errors:
            scene = self.scene
            self._position_errors[key] = tas(
                scene.gt_positions,
                scene.est_positions,
                rng=self._registration_seed(options.seed),
                unit=self._unit(options.quantile, options.interpolated),
                n_hypotheses=options.n_hypotheses,
                max_threshold=options.max_threshold,
                registration=self._registration(options),
            ).errors
        return self._position_errors[key]

    def _registration_seed(self, seed: int | None) -> np.random.SeedSequence:
        """Return the scene's seed, or one of its children."""
        if seed is None:
            return self._seed
        return np.random.SeedSequence(self._seed.entropy, spawn_key=(*self._seed.spawn_key, seed))

    def _registration(self, options: TASOptions) -> str | Registration:
        """Return the registration: the paper's with another prescreening threshold or another m."""
        if options.registration == "literal_frames":
            return literal_frames
        if options.model_fields_set.isdisjoint(("prescreen", "order")):
            return options.registration
        m = max(4, floor(_exact(options.order * len(self.scene.gt_positions)) + 0.5))

        def register(
            gt: Floats, est: Floats, /, *, rank: int, **settings: Any
        ) -> tuple[Similarity | None, int]:
            rank = min(m, len(gt))
            return pcr99(gt, est, rank=rank, prescreen=options.prescreen, **settings)

        return register

    def d(self, options: UnitOptions) -> float:
        """Return the unit of the TAS."""
        return self._unit(0.75, options.interpolated)

    def _unit(self, quantile: float, interpolated: bool) -> float:
        """Return d of the paper for any quantile, an order statistic or between two."""
        if interpolated:
            return float(np.quantile(self._closest_pairs, quantile))
        return _order_statistic(self._closest_pairs, quantile)

    @cached_property
    def _closest_pairs(self) -> Floats:
        return np.sort(closest_pair_distances(self.scene.gt_positions))

    @property
    def _rotation_errors(self) -> Floats:
        return self.beside.rotation_errors[self.place]

    @cached_property
    def _l1_errors(self) -> Floats:
        """Rotation errors after the geodesic L1 mean, in some order; infinite for missing ones."""
        scene = self.scene.estimated
        gt, est = scene.gt_rotations, scene.est_rotations
        angles = aligned_angles(gt, est, rotation_l1_mean(gt @ est.transpose(0, 2, 1)))
        return np.append(angles, np.full(len(self.scene.gt_rotations) - len(angles), inf))


@cache
def _of_tas(options: PASOptions) -> TASOptions:
    """Return the options of the TAS in a PAS."""
    return TASOptions(**options.model_dump(exclude={"weight"}))


@cache
def _registered_alike(options: TASOptions) -> TASOptions:
    """Return the same options for all that have one alignment."""
    # PCR-99 knows nothing of unit and thresholds, whatever they are.
    other: dict[str, float] = {"n_thresholds": 100}
    if options.registration != "refined":
        other |= {"max_threshold": 1.0, "quantile": 0.75, "interpolated": False}
    return options.model_copy(update=other)


def _score(errors: Floats, unit: float, largest: float, count: float) -> float:
    """Score errors; with infinitely many thresholds it is the area under a straight line."""
    if count == inf:
        return float(np.clip(1 - errors / (unit * largest), 0, None).mean())
    return AlignmentScore(errors, unit * equal_steps(largest, int(count), "largest")).score


def _order_statistic(ascending: Floats, quantile: float) -> float:
    """Return the ceil(q n)-th smallest of n values in ascending order."""
    return float(ascending[ceil(_exact(quantile * len(ascending))) - 1])


def _exact(product: float) -> float:
    """Take the rounding error off a share of a number: 0.07 of 100 is 7, not a little more."""
    return round(product, 9)


def _ate(evaluation: Evaluation, _: Options) -> float:
    scene = evaluation.scene.estimated
    return ate(scene.gt_positions, scene.est_positions)


def _statistic(name: str, alignment: str) -> TrialMetric:
    return TrialMetric(
        named(
            name,
            f"{name[:-2]} of the rotation errors after an {alignment} alignment",
            lambda gt, est: rotation_statistics(gt[:, :, :3], est[:, :, :3])[name],
            "refused",
            unit="deg",
        ),
        lambda evaluation, _: float(evaluation.beside.rotation_statistics[name][evaluation.place]),
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
    TrialMetric(metric("ATE").family, _ate),
    TrialMetric(
        named("DTE", "discernible trajectory error", dte, "refused"),
        lambda evaluation, _: float(evaluation.beside.dte[evaluation.place]),
    ),
    TrialMetric(_MAA, Evaluation.maa, MAAOptions),
    TrialMetric(metric("TAS").family, Evaluation.tas, TASOptions),
    TrialMetric(metric("RAS").family, Evaluation.ras, RASOptions),
    TrialMetric(metric("PAS").family, Evaluation.pas, PASOptions),
    TrialMetric(metric("half_distance").family, Evaluation.half_distance, HalfDistanceOptions),
    TrialMetric(metric("half_angle").family, Evaluation.half_angle, HalfAngleOptions),
    TrialMetric(_DRE, lambda evaluation, _: float(evaluation.beside.dre[evaluation.place])),
    *(_statistic(f"{name}-1", "L1") for name in ("Median", "Mean", "RMS")),
    *(_statistic(f"{name}-2", "L2") for name in ("Median", "Mean", "RMS")),
    TrialMetric(_UNIT, Evaluation.d, UnitOptions),
)
METRICS: Mapping[str, TrialMetric] = {entry.family.example: entry for entry in _TRIAL_METRICS}
"""All metrics but the protocols by their names. To add one, add its entry above."""
