"""Claims of the paper, and the trials that decide them: ``configs/claims.yaml``, typed."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field, replace
from itertools import chain, starmap
from math import inf, isfinite
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import ConfigDict, Field, ValidationError, model_validator
from pydantic.dataclasses import dataclass

from experiments.command import ConfigError, problems
from experiments.config import CONFIG_DIR, MetricName, experiment_names, one_of, read_yaml, require
from experiments.grid import CELL_SETTINGS
from experiments.metrics import split_options, with_options

from .statistics import STATISTICS, SUMMARIES, Statistic, Where

CLAIMS_FILE = CONFIG_DIR / "claims.yaml"
BOUNDS = ("at least", "below", "within")
ROUNDING = 0.5  # of the last digit of the paper's numbers
KNOWN_KEYS = ConfigDict(extra="forbid")


CellSetting = Annotated[str, one_of(CELL_SETTINGS)]
ExperimentName = Annotated[str, one_of(experiment_names())]
StatisticName = Annotated[str, one_of(STATISTICS)]
Filter = dict[CellSetting, Annotated[list[float], Field(min_length=1)]]


@dataclass(frozen=True, config=KNOWN_KEYS)
class Claim:
    """One checkable statement. The keys and their meaning stand in ``configs/claims.yaml``."""

    id: str
    statement: str
    sentence: str  # the statement of the paper that it is a part of
    source: str
    figure: str
    experiment: ExperimentName
    statistic: StatisticName
    metric: MetricName
    versus: MetricName | None = None
    level: list[CellSetting] = field(default_factory=list)
    summary: Annotated[str, one_of(SUMMARIES)] = "smallest"
    where: Filter = field(default_factory=dict)
    before: Filter = field(default_factory=dict)
    after: Filter = field(default_factory=dict)
    at: Filter = field(default_factory=dict)
    paper: float | None = None
    criterion: str | None = None
    settings: list[str] = field(default_factory=list)
    implied_by: list[str] = field(default_factory=list)
    of_means: bool = False

    @model_validator(mode="after")
    def _can_be_decided(self) -> Self:
        for key in self.rule.needs:
            require(bool(getattr(self, key)), f"needs {key!r} for its statistic")
        local = "at" in self.rule.keys
        require(local or not self.at, "has 'at', which its statistic does not take")
        has_target = (self.paper is None) != (self.criterion is None)
        require(has_target, "needs either a number of the paper or a criterion")
        if self.criterion is not None:
            relation, number = self.bound
            is_bounded = relation in BOUNDS and isfinite(number)
            require(is_bounded, f"needs a criterion such as {' or '.join(BOUNDS)} 0.5")
        return self

    @property
    def rule(self) -> Statistic:
        """The entry of its statistic."""
        return STATISTICS[self.statistic]

    @property
    def is_difference(self) -> bool:
        """Whether its statistic is a difference, of `metric` minus `versus`."""
        return self.versus is not None and "versus" not in self.rule.needs

    @property
    def unit(self) -> str:
        """The unit of its statistic: ``%``, ``points`` of it, or ``τ``."""
        if not self.rule.is_percentage:
            return "τ"
        return "points" if self.is_difference else "%"

    @property
    def bound(self) -> tuple[str, float]:
        """The criterion as one of `BOUNDS` and a number."""
        relation, _, number = (self.criterion or "").rpartition(" ")
        try:
            return relation, float(number)
        except ValueError:
            return "", 0.0

    @property
    def interval(self) -> tuple[float, float]:
        """The values of the statistic with which it holds; the paper's numbers are rounded."""
        if self.paper is not None:
            return self.paper - ROUNDING, self.paper + ROUNDING
        relation, number = self.bound
        if relation == "within":
            return -number, number
        return (number, inf) if relation == "at least" else (-inf, number)

    @property
    def metrics(self) -> tuple[str, ...]:
        """The metrics it needs."""
        return (self.metric,) if self.versus is None else (self.metric, self.versus)

    @property
    def trials(self) -> tuple[str, tuple[str, ...]]:
        """The experiment and the settings that its trials are run with."""
        return self.experiment, tuple(self.settings)

    def describe(self) -> str:
        """Write the statistic out."""
        metric = f"{self.metric} minus {self.versus}" if self.is_difference else self.metric
        text = self.rule.text.format(
            metric=metric, versus=self.versus, level=" and ".join(self.level)
        )
        others = {len(values) for key, values in self.where.items() if key not in self.level}
        parts = [
            self.summary if self.level and others != {1} else "",  # there are many groups
            f"at {_write(self.at)} of" if self.at else "",
            _write(self.where),
            f"{_write(self.before)} → {_write(self.after)}" if self.before else "",
        ]
        cells = "; ".join(filter(None, parts))
        return f"{text} ({cells})" if cells else text


def intersection(where: Filter, other: Filter) -> Filter:
    """Return what both let pass."""
    return {
        key: [value for value in values if value in other.get(key, values)]
        for key, values in {**other, **where}.items()
    }


@dataclass(frozen=True, config=KNOWN_KEYS)
class Reading:
    """One way to read what the paper leaves open, and how it changes a claim."""

    reading: str
    experiments: list[ExperimentName] = field(default_factory=list)
    settings: list[str] = field(default_factory=list)
    metrics: dict[MetricName, MetricName] = field(default_factory=dict)
    statistics: dict[StatisticName, StatisticName] = field(default_factory=dict)
    level: list[CellSetting] = field(default_factory=list)
    where: Filter = field(default_factory=dict)
    everywhere: bool = False
    of_means: bool = False
    replicates: int | None = None

    def of(self, claim: Claim) -> Claim:
        """Return the claim under this reading: the same, where the reading does not concern it."""
        if self.experiments and claim.experiment not in self.experiments:
            return claim
        if "at" in claim.rule.needs and (self.everywhere or self.where):
            return claim  # it compares some cells with all on its own
        values: dict[str, Any] = {
            "metric": self._of(claim.metric),
            "versus": claim.versus and self._of(claim.versus),
            "statistic": self.statistics.get(claim.statistic, claim.statistic),
            "level": self.level or claim.level,
            "settings": [*claim.settings, *self.settings],
            "where": intersection(claim.where, self.where),
            "at": {} if self.everywhere else claim.at,
            "of_means": self.of_means and claim.rule.has_ranges,
        }
        if all(value == getattr(claim, key) for key, value in values.items()):
            return claim  # as most are: without checking them again
        return replace(claim, **values)

    def _of(self, metric: str) -> str:
        """Return the metric under this reading, with its options."""
        name, options = split_options(metric)
        if name not in self.metrics:
            return metric
        other, others = split_options(self.metrics[name])
        return with_options(other, {**others, **options})


@dataclass(frozen=True, config=KNOWN_KEYS)
class Decision:
    """A decision where the paper is silent or contradicts itself."""

    id: str
    question: str
    paper: str
    choice: str
    readings: Annotated[list[Reading], Field(min_length=2)]
    claims: list[str] = field(default_factory=list)


@dataclass(frozen=True, config=KNOWN_KEYS)
class Criterion:
    """A bound that we chose for a word of the paper, and other possible ones."""

    word: str
    bound: float
    others: Annotated[list[float], Field(min_length=1)]

    def replace(self, claim: Claim, other: float) -> Claim:
        """Return the claim with another bound, unchanged if its bound is a different one."""
        relation, number = claim.bound
        is_of_it = claim.criterion is not None and number == self.bound
        return replace(claim, criterion=f"{relation} {other:g}") if is_of_it else claim


@dataclass(frozen=True, config=KNOWN_KEYS)
class _Group:
    """Claims as they stand in the file, and what they share."""

    source: str
    figure: str
    experiment: str
    claims: list[dict[str, Any]]


@dataclass(frozen=True, config=KNOWN_KEYS)
class _File:
    replicates: int
    replicates_of_readings: Annotated[int, Field(ge=2)]
    criteria: list[Criterion]
    groups: list[_Group]
    decisions: list[dict[str, Any]]


@dataclass(frozen=True)
class Claims:
    """All claims by their names, the decisions and criteria, and how many studies decide."""

    replicates: int
    replicates_of_readings: int  # the first ones, which have what other readings need, too
    claims: Mapping[str, Claim]
    decisions: Sequence[Decision]
    criteria: Sequence[Criterion]

    def n_studies(self, reading: Reading) -> int:
        """Return how many replicate studies decide a reading: the first ones."""
        return min(self.replicates, reading.replicates or self.replicates_of_readings)

    def needed(self, replicate: int) -> Iterator[Claim]:
        """All claims that a replicate study decides: as they are, and under other readings."""
        yield from self.claims.values()
        for _, reading, claims in self.other_readings():
            if replicate < self.n_studies(reading):
                yield from claims.values()

    def other_readings(self) -> Iterator[tuple[Decision, Reading, dict[str, Claim]]]:
        """All readings but the chosen ones, with the claims that they change, by their names."""
        for decision in self.decisions:
            for reading in decision.readings[1:]:
                yield decision, reading, self.under(decision, reading)

    def under(self, decision: Decision, reading: Reading) -> dict[str, Claim]:
        """Return the claims that a reading changes, as they are then."""
        names = decision.claims or self.claims
        pairs = ((name, self.claims[name], reading.of(self.claims[name])) for name in names)
        return {name: changed for name, claim, changed in pairs if changed != claim}


def load_claims(replicates: int | None = None, path: Path = CLAIMS_FILE) -> Claims:
    """Read the claims; a list of metrics becomes one claim of each."""
    file = read_yaml(path, _File)
    replicates = file.replicates if replicates is None else replicates
    if type(replicates) is not int or replicates < 2:
        raise ConfigError(
            f"setting 'replicates' must be a whole number of at least 2, not {replicates!r}: "
            "one study has no spread"
        )
    entries = [(group, entry) for group in file.groups for entry in group.claims]
    expanded = list(chain.from_iterable(starmap(_expand, entries)))
    claims = {claim.id: claim for claim in expanded}
    for claim in expanded:
        if claim is not claims[claim.id]:
            raise ConfigError(f"claims.yaml: {claim.id!r} is defined twice")
        for name in claim.implied_by:
            if name not in claims or name == claim.id:
                raise ConfigError(f"claims.yaml: {claim.id!r} is implied by no claim: {name!r}")
    decisions = [_decision(entry, claims) for entry in file.decisions]
    of_readings = min(replicates, file.replicates_of_readings)
    return Claims(replicates, of_readings, claims, decisions, file.criteria)


def _expand(group: _Group, entry: Mapping[str, Any]) -> Iterator[Claim]:
    """Make one claim of each metric of an entry."""
    shared = {"source": group.source, "figure": group.figure, "experiment": group.experiment}
    metrics = _list(entry.get("metric")) or [None]
    sentence = str(entry.get("statement")).replace("{metric}", "/".join(map(str, metrics)))
    for metric in metrics:
        slug = re.sub(r"[^a-z0-9.]+", "-", str(metric).lower()).strip("-")
        values = {**shared, **entry, "metric": metric, "level": _list(entry.get("level", []))}
        values["sentence"] = sentence
        for key, name in (("id", slug), ("statement", str(metric))):
            if isinstance(values.get(key), str):
                values[key] = values[key].replace("{metric}", name)
        if isinstance(values.get("implied_by"), list):
            values["implied_by"] = [str(n).replace("{metric}", slug) for n in values["implied_by"]]
        with _errors_named(values, f"a claim of {group.source}"):
            yield Claim(**values)


def _decision(entry: Mapping[str, Any], claims: Mapping[str, Claim]) -> Decision:
    with _errors_named(entry, "a decision"):
        decision = Decision(**entry)
    for name in decision.claims:
        if name not in claims:
            raise ConfigError(f"claims.yaml: {decision.id!r} names no claim: {name!r}")
    return decision


@contextmanager
def _errors_named(entry: Mapping[str, Any], otherwise: str) -> Iterator[None]:
    """Raise errors that name the part of the file that is wrong, by its id if it has one."""
    try:
        yield
    except ValidationError as error:
        key, problem = problems(error)[0]
        name = repr(entry["id"]) if "id" in entry else otherwise
        raise ConfigError(f"claims.yaml: {name}: {f'{key}: ' if key else ''}{problem}") from None


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _write(where: Where) -> str:
    return ", ".join(f"{key} {'/'.join(f'{v:g}' for v in values)}" for key, values in where.items())
