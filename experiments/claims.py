"""What the paper claims, and which trials can tell: ``configs/claims.yaml``, typed and checked."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite
from pathlib import Path
from typing import Any, TypeVar

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from .config import CONFIG_DIR, ConfigError, experiment_names, split_metric
from .statistics import SETTINGS, STATISTICS, TAKES, Cells

__all__ = [
    "CLAIMS_FILE",
    "Claim",
    "Claims",
    "Decision",
    "Reading",
    "load_claims",
    "split_replicates",
]

CLAIMS_FILE = CONFIG_DIR / "claims.yaml"
BOUNDS = ("at least", "below", "within")
HALF = 0.5  # of the last digit of the paper's numbers

T = TypeVar("T")


@dataclass(frozen=True)
class Claim:
    """One checkable statement. The keys and their meaning stand in ``configs/claims.yaml``."""

    id: str
    statement: str
    source: str
    figure: str
    experiment: str
    statistic: str
    metric: str
    versus: str | None = None
    level: list[str] = field(default_factory=list)
    take: str = "smallest"
    where: Cells = field(default_factory=dict)
    before: Cells = field(default_factory=dict)
    after: Cells = field(default_factory=dict)
    paper: float | None = None
    criterion: str | None = None
    settings: list[str] = field(default_factory=list)
    of_means: bool = False

    @property
    def is_percentage(self) -> bool:
        """Whether the statistic is in per cent; a correlation otherwise."""
        return STATISTICS[self.statistic].is_percentage

    @property
    def is_difference(self) -> bool:
        """Whether it is the statistic of `metric` minus that of `versus`."""
        return self.versus is not None and "versus" not in STATISTICS[self.statistic].needs

    @property
    def has_ranges(self) -> bool:
        """Whether the statistic compares ranges, which could also be those of mean curves."""
        return STATISTICS[self.statistic].has_ranges

    @property
    def bound(self) -> tuple[str, float]:
        """The criterion as one of `BOUNDS` and a number."""
        relation, _, number = (self.criterion or "").rpartition(" ")
        return relation, float(number)

    @property
    def interval(self) -> tuple[float, float]:
        """The values of the statistic with which it holds; the paper's numbers are rounded.

        Examples
        --------
        >>> from experiments.claims import load_claims
        >>> claims = load_claims().claims
        >>> claims["outliers-range-maa"].interval, claims["outliers-tas-discerns"].interval
        ((-74.5, -73.5), (0.5, inf))
        """
        if self.paper is not None:
            return self.paper - HALF, self.paper + HALF
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
        """Write the statistic out.

        Examples
        --------
        >>> from experiments.claims import load_claims
        >>> load_claims().claims["outliers-range-maa"].describe()
        'change of the range of mAA, % (n_outliers 0 → n_outliers 50)'
        """
        metric = f"{self.metric} minus {self.versus}" if self.is_difference else self.metric
        text = STATISTICS[self.statistic].text.format(
            metric=metric, versus=self.versus, level=" and ".join(self.level)
        )
        cells = [_write(self.where)] if self.where else []
        if self.before:
            cells.append(f"{_write(self.before)} → {_write(self.after)}")
        others = {len(values) for key, values in self.where.items() if key not in self.level}
        if self.level and others != {1}:  # there are many groups
            cells.insert(0, self.take)
        return f"{text} ({'; '.join(cells)})" if cells else text


@dataclass(frozen=True)
class Reading:
    """One way to read what the paper leaves open, and how it changes a claim."""

    reading: str
    settings: list[str] = field(default_factory=list)
    metric: str | None = None
    where: Cells = field(default_factory=dict)
    of_means: bool = False

    def of(self, claim: Claim) -> Claim:
        """Return the claim under this reading, in those of its cells that there are then."""
        left = {
            key: [value for value in values if value in self.where.get(key, values)]
            for key, values in claim.where.items()
        }
        return replace(
            claim,
            metric=self.metric or claim.metric,
            settings=self.settings or claim.settings,
            where={**self.where, **left},
            of_means=self.of_means,
        )


@dataclass(frozen=True)
class Decision:
    """What was decided where the paper is silent or contradicts itself."""

    id: str
    question: str
    paper: str
    choice: str
    claims: list[str]
    readings: list[Reading]


@dataclass(frozen=True)
class _Group:
    """Claims as they stand in the file, and what they share."""

    source: str
    figure: str
    experiment: str
    claims: list[Any]


@dataclass(frozen=True)
class _File:
    replicates: Any
    groups: list[_Group]
    decisions: list[Any]


@dataclass(frozen=True)
class Claims:
    """All claims by their names, the decisions, and how many studies to decide them by."""

    replicates: int
    claims: Mapping[str, Claim]
    decisions: Sequence[Decision]

    def __iter__(self) -> Iterator[Claim]:
        """All claims, as they are and under the readings of the decisions."""
        yield from self.claims.values()
        for decision in self.decisions:
            for reading in decision.readings:
                yield from (reading.of(self.claims[name]) for name in decision.claims)


def load_claims(replicates: int | None = None, path: Path = CLAIMS_FILE) -> Claims:
    """Read the claims.

    Parameters
    ----------
    replicates : int, optional
        Number of replicate studies; by default the one in the file.
    path : Path
        The file.

    Returns
    -------
    Claims
        The claims and decisions; a list of metrics has become one claim of each.

    Raises
    ------
    ConfigError
        In one line that names the claim, where something is missing, unknown or impossible.

    Examples
    --------
    >>> from experiments.claims import load_claims
    >>> claim = load_claims().claims["outliers-range-maa"]
    >>> claim.paper, claim.metric
    (-74.0, 'mAA')
    """
    try:
        content = OmegaConf.load(path)
    except (OSError, YAMLError, OmegaConfBaseException) as error:
        raise ConfigError(f"cannot read {path}: {' '.join(str(error).split())}") from None
    file = _make(_File, content, "the file")
    replicates = file.replicates if replicates is None else replicates
    if type(replicates) is not int or replicates < 2:
        raise ConfigError(
            f"setting 'replicates' must be a whole number of at least 2, not {replicates!r}: "
            "one study tells nothing of the spread"
        )
    claims: dict[str, Claim] = {}
    for group in file.groups:
        for entry in group.claims:
            for claim in _expand(group, entry):
                _require(claim.id not in claims, claim.id, "stands there twice")
                claims[claim.id] = claim
    decisions = [_decision(entry, claims) for entry in file.decisions]
    return Claims(replicates, claims, decisions)


def split_replicates(overrides: Sequence[str]) -> tuple[int | None, list[str]]:
    """Split ``replicates=R`` off the settings of an experiment; None where it is not given.

    Examples
    --------
    >>> from experiments.claims import split_replicates
    >>> split_replicates(["trials=5", "replicates=3"])
    (3, ['trials=5'])
    """
    replicates, others = None, []
    for override in overrides:
        key, _, value = (part.strip() for part in override.partition("="))
        if key != "replicates":
            others.append(override)
        elif value.isdecimal():
            replicates = int(value)
        else:
            raise ConfigError(f"setting 'replicates' must be a whole number, not {value!r}")
    return replicates, others


def _expand(group: _Group, entry: Any) -> Iterator[Claim]:
    """Make one claim of each metric of an entry."""
    _require(isinstance(entry, dict), group.source, f"has no keys for a claim: {entry!r}")
    shared = {"source": group.source, "figure": group.figure, "experiment": group.experiment}
    for metric in _list(entry.get("metric")) or [None]:
        level = _list(entry.get("level", []))
        values = {**shared, **entry, "metric": metric, "level": level}
        claim = _make(Claim, values, entry.get("id", f"a claim of {group.source}"))
        slug = re.sub(r"[^a-z0-9.]+", "-", claim.metric.lower()).strip("-")
        claim = replace(
            claim,
            id=claim.id.replace("{metric}", slug),
            statement=claim.statement.replace("{metric}", claim.metric),
        )
        _check(claim)
        yield claim


def _decision(entry: Any, claims: Mapping[str, Claim]) -> Decision:
    _require(isinstance(entry, dict), "decisions", f"has no keys for a decision: {entry!r}")
    decision = _make(Decision, entry, entry.get("id", "a decision"))
    for key in ("claims", "readings"):
        _require(bool(getattr(decision, key)), decision.id, f"needs {key}")
    for name in decision.claims:
        _require(name in claims, decision.id, f"names no claim: {name!r}")
        for reading in decision.readings:
            _check(reading.of(claims[name]))
    return decision


def _make(kind: type[T], values: Any, name: str) -> T:
    """Make a dataclass of what the file has for it: all its keys, no others, of their types."""
    try:
        made = OmegaConf.to_object(OmegaConf.merge(OmegaConf.structured(kind), values))
    except (OmegaConfBaseException, ValueError) as error:
        reason = str(getattr(error, "msg", None) or error).splitlines()[0]
        key = getattr(error, "full_key", None)
        raise ConfigError(f"claims.yaml: {name!r}: {f'{key}: ' if key else ''}{reason}") from None
    assert isinstance(made, kind)
    return made


def _check(claim: Claim) -> None:
    """Refuse what could not be decided."""
    name = claim.id
    choice = ", ".join(STATISTICS)
    _require(claim.statistic in STATISTICS, name, f"has an unknown statistic; they are {choice}")
    for key in STATISTICS[claim.statistic].needs:
        _require(bool(getattr(claim, key)), name, f"needs {key!r} for its statistic")
    _require(claim.experiment in experiment_names(), name, "has an unknown experiment")
    for metric in claim.metrics:
        try:
            split_metric(metric)
        except ConfigError as error:
            raise ConfigError(f"claims.yaml: {name!r}: {error}") from None
    _require(claim.take in TAKES, name, f"has an unknown 'take'; they are {', '.join(TAKES)}")
    choice = ", ".join(SETTINGS)
    for cells in (claim.where, claim.before, claim.after):
        _require(set(cells) <= set(SETTINGS), name, f"may select cells by {choice}")
        for values in cells.values():
            numbers = [value for value in values if type(value) in (int, float)]
            known = bool(numbers) and numbers == values
            _require(known, name, "needs a list of numbers for each setting")
    _require(set(claim.level) <= set(SETTINGS), name, f"has an unknown level; they are {choice}")
    one = (claim.paper is None) != (claim.criterion is None)
    _require(one, name, "needs either a number of the paper or a criterion")
    if claim.criterion is None:
        return
    try:
        relation, number = claim.bound
    except ValueError:
        relation, number = "", 0.0
    known = relation in BOUNDS and isfinite(number)
    _require(known, name, f"needs a criterion such as {' or '.join(BOUNDS)} 0.5")


def _require(condition: bool, name: str, problem: str) -> None:
    if not condition:
        raise ConfigError(f"claims.yaml: {name!r} {problem}")


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _write(cells: Cells) -> str:
    return ", ".join(f"{key} {'/'.join(f'{v:g}' for v in values)}" for key, values in cells.items())
