"""What the paper claims, and which trials can tell: ``configs/claims.yaml``, typed and checked."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar, cast

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from .config import CONFIG_DIR, ConfigError, experiment_names, split_metric

__all__ = ["CLAIMS_FILE", "Claim", "Claims", "Decision", "Reading", "load_claims"]

CLAIMS_FILE = CONFIG_DIR / "claims.yaml"
STATISTICS = {  # with what each needs
    "range change": ("before", "after"),
    "unsteadiness": ("before", "after"),
    "relative range": ("versus",),
    "power": ("level",),
    "favour": ("level",),
    "dependence": ("level",),
    "first step": ("level",),
}
TAKES = ("smallest", "largest", "mean")
LEVELS = ("n_cameras", "n_outliers", "sigma_t", "sigma_r_deg")
BOUNDS = ("at least", "below", "within")

T = TypeVar("T")
Cells = Mapping[str, Sequence[float]]  # values of settings; cells with any of them are meant


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
    level: Sequence[str] = ()
    take: str = "smallest"
    where: Cells = field(default_factory=dict)
    before: Cells = field(default_factory=dict)
    after: Cells = field(default_factory=dict)
    paper: float | None = None
    criterion: str | None = None
    settings: Sequence[str] = ()
    of_means: bool = False

    @property
    def is_percentage(self) -> bool:
        """Whether the statistic is in per cent; a correlation otherwise."""
        return self.statistic not in ("power", "favour")

    @property
    def has_ranges(self) -> bool:
        """Whether the statistic compares ranges, which could also be those of mean curves."""
        return self.statistic in ("range change", "unsteadiness", "relative range")

    @property
    def bound(self) -> tuple[str, float]:
        """The criterion as one of `BOUNDS` and a number."""
        relation, _, number = (self.criterion or "").rpartition(" ")
        return relation, float(number)

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
        >>> load_claims().claims["outliers-ate-blind"].describe()
        '|τ| of ATE with sigma_t (n_outliers 1)'
        """
        text = {
            "range change": "change of the range of {}, %",
            "unsteadiness": "|change of the range| of {}, %",
            "relative range": "width of the range of {}, %",
            "power": "|τ| of {} with {level}",
            "favour": "τ of {} with {level}, positive where better",
            "dependence": "movement of the mean of {} over {level}, % of its range",
            "first step": "share of the first step of {level} in the change of {}, %",
        }[self.statistic]
        joint = " relative to " if self.statistic == "relative range" else " minus "
        text = text.format(joint.join(self.metrics), level=" and ".join(self.level))
        cells = [_write(cells) for cells in (self.where,) if cells]
        if self.before:
            cells.append(f"{_write(self.before)} → {_write(self.after)}")
        if self.level and not all(len(values) == 1 for values in self.where.values() or [()]):
            cells.insert(0, self.take)
        return f"{text} ({'; '.join(cells)})" if cells else text


@dataclass(frozen=True)
class Reading:
    """One way to read what the paper leaves open, and how it changes a claim."""

    reading: str
    settings: Sequence[str] = ()
    metric: str | None = None
    where: Cells = field(default_factory=dict)
    of_means: bool = False

    def of(self, claim: Claim) -> Claim:
        """Return the claim under this reading."""
        return replace(
            claim,
            metric=self.metric or claim.metric,
            settings=self.settings or claim.settings,
            where={**claim.where, **self.where},
            of_means=self.of_means,
        )


@dataclass(frozen=True)
class Decision:
    """What was decided where the paper is silent or contradicts itself."""

    id: str
    question: str
    paper: str
    choice: str
    claims: Sequence[str]
    readings: Sequence[Reading]


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

    def needs(self) -> list[tuple[Any, ...]]:
        """Return what the trials to be run depend on; where it changes, they are run again."""
        return [
            (*claim.trials, claim.metrics, claim.where, claim.before, claim.after) for claim in self
        ]


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
    (-74, 'mAA')
    """
    try:
        content = OmegaConf.to_container(OmegaConf.load(path))
    except (OSError, YAMLError, OmegaConfBaseException) as error:
        raise ConfigError(f"cannot read {path}: {' '.join(str(error).split())}") from None
    if not isinstance(content, dict) or not {"replicates", "groups", "decisions"} <= set(content):
        raise ConfigError(f"{path} needs the keys replicates, groups and decisions")
    replicates = content["replicates"] if replicates is None else replicates
    if not isinstance(replicates, int) or replicates < 2:
        raise ConfigError(
            f"setting 'replicates' must be a whole number of at least 2, not {replicates!r}: "
            "one study tells nothing of the spread"
        )
    claims: dict[str, Claim] = {}
    for group in content["groups"]:
        for entry in group["claims"]:
            shared = {key: value for key, value in group.items() if key != "claims"}
            for claim in _expand({**shared, **entry}):
                _require(claim.id not in claims, claim.id, "stands there twice")
                claims[claim.id] = claim
    decisions = [_decision(entry, claims) for entry in content["decisions"]]
    return Claims(replicates, claims, decisions)


def _expand(entry: dict[str, Any]) -> Iterator[Claim]:
    """Make one claim of each metric of an entry."""
    metrics = entry.get("metric", [])
    for metric in metrics if isinstance(metrics, list) else [metrics]:
        values = {**entry, "metric": metric, "level": _list(entry.get("level", []))}
        slug = re.sub(r"[^a-z0-9.]+", "-", str(metric).lower()).strip("-")
        values["id"] = str(values.get("id", "?")).replace("{metric}", slug)
        values["statement"] = str(values.get("statement", "?")).replace("{metric}", str(metric))
        claim = _make(Claim, values, values["id"])
        _check(claim)
        yield claim


def _decision(entry: dict[str, Any], claims: Mapping[str, Claim]) -> Decision:
    name = str(entry.get("id", "?"))
    readings = [_make(Reading, reading, name) for reading in entry.get("readings", [])]
    decision = _make(Decision, {**entry, "readings": readings}, name)
    for claim in decision.claims:
        _require(claim in claims, name, f"names no claim: {claim!r}")
    for reading in readings:
        for claim in decision.claims:
            _check(reading.of(claims[claim]))
    return decision


def _make(kind: type[T], values: Mapping[str, Any], name: str) -> T:
    """Make a Claim, Decision or Reading of what the file has for it."""
    known = [field.name for field in fields(cast(Any, kind))]
    for key in values:
        _require(key in known, name, f"has an unknown key {key!r}; known are {', '.join(known)}")
    try:
        return kind(**values)
    except TypeError as error:
        raise ConfigError(f"claims.yaml: {name!r}: {str(error).rpartition(') ')[2]}") from None


def _check(claim: Claim) -> None:
    """Refuse what could not be decided."""
    name = claim.id
    choice = ", ".join(STATISTICS)
    _require(claim.statistic in STATISTICS, name, f"has an unknown statistic; they are {choice}")
    for key in STATISTICS[claim.statistic]:
        _require(bool(getattr(claim, key)), name, f"needs {key!r} for its statistic")
    _require(claim.experiment in experiment_names(), name, "has an unknown experiment")
    for metric in claim.metrics:
        try:
            split_metric(metric)
        except ConfigError as error:
            raise ConfigError(f"claims.yaml: {name!r}: {error}") from None
    _require(claim.take in TAKES, name, f"has an unknown 'take'; they are {', '.join(TAKES)}")
    for cells in (claim.where, claim.before, claim.after):
        known = isinstance(cells, Mapping) and set(cells) <= set(LEVELS)
        _require(known, name, f"may select cells by {', '.join(LEVELS)}")
        for values in cells.values():
            _require(isinstance(values, list), name, "needs a list of values for each setting")
    unknown = sorted(set(claim.level) - set(LEVELS))
    _require(not unknown, name, f"has an unknown level; they are {', '.join(LEVELS)}")
    one = (claim.paper is None) != (claim.criterion is None)
    _require(one, name, "needs either a number of the paper or a criterion")
    if claim.criterion is not None:
        try:
            relation, _ = claim.bound
        except ValueError:
            relation = ""
        _require(relation in BOUNDS, name, f"needs a criterion such as {' or '.join(BOUNDS)} 0.5")


def _require(condition: bool, name: str, problem: str) -> None:
    if not condition:
        raise ConfigError(f"claims.yaml: {name!r} {problem}")


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


def _write(cells: Cells) -> str:
    return ", ".join(f"{key} {'/'.join(f'{v:g}' for v in values)}" for key, values in cells.items())
