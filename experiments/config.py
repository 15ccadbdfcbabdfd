"""Settings of a sweep: composed by Hydra from ``configs/``, then typed and checked in one place."""

import json
import os
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import field, fields
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic.dataclasses import dataclass

from alignscores.texts import brief
from alignscores.writing import write_whole
from alignscores.yaml_files import load_yaml

from .command import ConfigError, problems
from .metrics import MOST, MetricOptions, Positive, metric
from .scenes import ERRORS, OUTLIERS, PATHS

if TYPE_CHECKING:
    from omegaconf import DictConfig

__all__ = [
    "CONFIG_DIR",
    "EXECUTION",
    "EXPERIMENTS",
    "Execution",
    "MetricName",
    "Selection",
    "Sweep",
]
__all__ += ["as_dict", "checked", "experiment_names", "flat", "hydra_errors", "load"]
__all__ += ["load_sweep", "one_of", "read_yaml", "register_defaults", "require", "settings_file"]
__all__ += ["split_override", "to_overrides"]

CONFIG_DIR = Path(__file__).resolve().parent.parent / "configs"
EXPERIMENTS = (
    "outliers",  # section 6.1.1, figure 2
    "collinear",  # 6.1.2, figure 3
    "trajectory_length",  # 6.1.3, figure 4
    "rotations",  # 6.2, figure 5
    "combined",  # 6.3.1, figures 1 and 6
    "maa_vs_pas_outliers",  # 6.3.2a, figure 7
    "maa_vs_pas_length",  # 6.3.2b
    "maa_vs_pas_collinear",  # 6.3.2c
)
"""The paper's experiments; other files in ``configs/experiment`` are the user's."""

STRICT = ConfigDict(strict=True, extra="forbid")
N_SHOWN = 3  # problems of a file: a key that is missing is often one that is misspelt

T = TypeVar("T")


def one_of(choices: Collection[str]) -> AfterValidator:
    """Validate that a value is one of some names, whichever these are at the time."""

    def check(value: str) -> str:
        if value not in choices:
            near = get_close_matches(value, choices, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise ValueError(f"must be one of {', '.join(choices)}, not {brief(value)}{hint}")
        return value

    return AfterValidator(check)


def _distinct(values: list[Any]) -> list[Any]:
    if len(set(values)) < len(values):
        raise ValueError(f"has a value twice: {brief(values)}")
    return values


def _process_count(number: int) -> int:
    require(number != 0, "must be positive, or -1 for all")
    return number


def _table(name: str) -> str:
    require(name.endswith(".csv"), f"must end in .csv, not {brief(name)}")
    return name


def _metric(name: str) -> str:
    metric(name)
    return name


MetricName = Annotated[str, AfterValidator(_metric)]
Noise = Annotated[float, Field(ge=0, le=MOST, allow_inf_nan=False)]
Levels = Annotated[list[Noise], Field(min_length=1), AfterValidator(_distinct)]
Metrics = Annotated[list[MetricName], Field(min_length=1), AfterValidator(_distinct)]
Cameras = Annotated[int, Field(ge=4, le=MOST)]  # with fewer the TAS is undefined
Outliers = Annotated[int, Field(ge=0)]


@dataclass(frozen=True, config=STRICT)
class Selection:
    """Metrics, and for some settings of a cell the values at which they are evaluated."""

    metrics: Metrics
    where: dict[str, list[float]]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Sweep(MetricOptions):
    """One grid of cells with the trials that are run in each. Keys as in ``configs/``."""

    name: str
    geometry: Annotated[str, one_of(PATHS)]
    error: Annotated[str, one_of(ERRORS)]
    outliers: Annotated[str, one_of(OUTLIERS)]
    outlier_side: Positive
    volume_per_camera: Positive | None
    n_cameras: Annotated[list[Cameras], Field(min_length=1), AfterValidator(_distinct)]
    n_outliers: Annotated[list[Outliers], Field(min_length=1), AfterValidator(_distinct)]
    sigma_t: Levels
    sigma_r_deg: Levels
    noise: Literal["product", "paired"]
    metrics: Metrics
    trials: Annotated[int, Field(ge=1, le=MOST)]
    seed: Annotated[int, Field(ge=0)]
    replicate: Annotated[int, Field(ge=0)]
    every: Annotated[int, Field(ge=1)] = 1
    frame: Literal["trial", "study"] = "trial"
    # A study sets these; they are in no file.
    changes: str = ""  # from the experiment's own settings, where a table has several sweeps
    selections: list[Selection] = field(default_factory=list)  # by default all metrics in all cells

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        n_outliers, n_cameras = max(self.n_outliers), min(self.n_cameras)
        require(
            n_outliers <= n_cameras,
            f"'n_outliers' has {n_outliers}, more than the {n_cameras} cameras",
        )
        require(
            self.outliers == "uniform" or n_outliers <= n_cameras - 4,
            f"'n_outliers' must leave at least 4 inliers with outliers={self.outliers}",
        )
        require(
            self.noise == "product" or len(self.sigma_t) == len(self.sigma_r_deg),
            "'noise' is paired, so sigma_t and sigma_r_deg need the same number of levels",
        )
        require(
            n_cameras >= 4 * self.every,
            f"'every' leaves fewer than 4 of the {n_cameras} cameras",
        )
        require(
            self.volume_per_camera is None or self.geometry == "cube",
            "'volume_per_camera' applies only to the cube",
        )
        return self


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Execution:
    """How a sweep is run and where its table goes: nothing that results depend on."""

    n_jobs: Annotated[int, Field(ge=-1), AfterValidator(_process_count)]
    output: Annotated[str, AfterValidator(_table)] | None


def require(condition: bool, problem: str) -> None:
    """Fail a validation that concerns several settings."""
    if not condition:
        raise ValueError(problem)


EXECUTION = tuple(key.name for key in fields(Execution))


def experiment_names() -> list[str]:
    """Return the names of all experiments: one YAML file each."""
    return sorted(path.stem for path in (CONFIG_DIR / "experiment").glob("*.yaml"))


def register_defaults() -> None:
    """Make the options of metrics keys of ``configs/config.yaml``, with the paper's values."""
    from hydra.core.config_store import ConfigStore

    node = TypeAdapter(MetricOptions).dump_python(MetricOptions())
    ConfigStore.instance().store(name="metric_options", node=node)


def checked(settings: Mapping[str, Any]) -> tuple[Sweep, Execution]:
    """Return composed settings typed: those that results depend on, and those that they do not.

    A `ConfigError` names in one line the key and what is wrong with its value.
    """
    execution = {key: settings[key] for key in EXECUTION}
    others = {key: value for key, value in settings.items() if key not in EXECUTION}
    try:
        return Sweep(**others), Execution(**execution)
    except ValidationError as error:
        key, problem = problems(error)[0]
        if "valid list" in problem:
            problem = "must be a list in brackets, for example [1, 2]"
        key = re.sub(r"\.\d+$", "", key)  # of an entry of a list
        name = f"{key!r}: " if key else ""
        raise ConfigError(f"setting {name}{problem}") from None


def load(overrides: Sequence[str] = ()) -> tuple[Sweep, Execution]:
    """Compose and check one experiment, as ``python -m experiments.run`` does."""
    return checked(_composed(tuple(overrides)))


@cache
def _composed(overrides: tuple[str, ...]) -> Mapping[str, Any]:
    """Return the settings of an experiment with some changes.

    Studies compose dozens. Since Hydra takes 0.1 s for each, it composes an experiment once, and
    plain changes are applied here. Others are left to Hydra, which says what is wrong with them.
    """
    # Hydra takes long to import, and programs that read tables do not need it.
    from omegaconf import OmegaConf
    from omegaconf.errors import OmegaConfBaseException

    with hydra_errors(" ".join(overrides)):
        experiment = tuple(line for line in overrides if line.startswith("experiment="))
        changes = [_plain_change(line) for line in overrides if line not in experiment]
        if None in changes:
            return as_dict(_composed_by_hydra(overrides))
        config = deepcopy(_composed_by_hydra(experiment))
        try:
            for key, value in filter(None, changes):
                OmegaConf.update(config, key, value)
        except OmegaConfBaseException:
            config = _composed_by_hydra(overrides)
        return as_dict(config)


@cache
def _plain_change(override: str) -> tuple[str, Any] | None:
    """Return key and value of ``key=value``, None for all else that Hydra's grammar has."""
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.core.override_parser.types import OverrideType
    from hydra.errors import HydraException

    try:
        parsed = OverridesParser.create().parse_override(override)
    except HydraException:
        return None
    plain = parsed.type is OverrideType.CHANGE and parsed.package is None
    return (parsed.key_or_group, parsed.value()) if plain else None


@cache
def _composed_by_hydra(overrides: tuple[str, ...]) -> "DictConfig":
    from hydra import compose, initialize_config_dir

    register_defaults()
    with initialize_config_dir(config_dir=str(CONFIG_DIR), version_base="1.3"):
        return compose(config_name="config", overrides=list(overrides))


@contextmanager
def hydra_errors(overrides: str) -> Iterator[None]:
    """Raise what Hydra reports in several lines as a `ConfigError` in one."""
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException

    try:
        yield
    except (HydraException, OmegaConfBaseException) as error:
        reason = str(error).splitlines()[0].rstrip(".")
        nearest = _nearest_name(reason)
        advice = f"did you mean {nearest}?" if nearest else "run: python -m experiments.run --help"
        if reason.startswith("Error parsing") and "(" in reason:
            advice = "quote names with brackets: \"metrics=[TAS,'TAS(max_threshold=2)']\""
        raise ConfigError(f"cannot read {overrides}: {reason}; {advice}") from None


def _nearest_name(reason: str) -> str:
    """Return the experiment or setting nearest to the unknown name in Hydra's message, if any."""
    unknown = re.search(r"Could not (?:find 'experiment/|override ')([^']+)'", reason)
    names = [*experiment_names(), *(item.name for item in fields(Sweep)), *EXECUTION]
    names += flat(TypeAdapter(MetricOptions).dump_python(MetricOptions()))
    near = get_close_matches(unknown[1], names, n=1) if unknown else []
    return near[0] if near else ""


def as_dict(config: "DictConfig") -> dict[str, Any]:
    """Return composed settings as a dictionary."""
    from omegaconf import OmegaConf

    settings = OmegaConf.to_container(config, resolve=True)
    assert isinstance(settings, dict)
    return {str(key): value for key, value in settings.items()}


def load_sweep(overrides: Sequence[str] = ()) -> Sweep:
    """Return the settings of one experiment that results depend on; see `load`."""
    return load(overrides)[0]


def to_overrides(settings: Mapping[str, Any]) -> list[str]:
    """Return settings, from YAML or ``snakemake --config``, as Hydra overrides."""
    return [f"{key}={_hydra_value(value)}" for key, value in flat(settings).items()]


def flat(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings without nesting: ``tas: {order: 0.2}`` becomes ``tas.order: 0.2``."""
    result: dict[str, Any] = {}
    for key, value in settings.items():
        if isinstance(value, Mapping):
            result |= {f"{key}.{name}": part for name, part in flat(value).items()}
        else:
            result[key] = value
    return result


def _hydra_value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{','.join(map(_hydra_value, value))}]"
    if isinstance(value, str) and not re.fullmatch(r"[\w.+-]+", value, re.ASCII):
        return "'{}'".format(value.replace("'", r"\'"))
    return "null" if value is None else str(value)


def settings_file(results: Path, table: str, sweeps: Sequence[Sweep]) -> Path:
    """Return the file of the settings that a table of trials should have, an input of its rule.

    The file is written, and then newer than the table, where the table's record has other settings.
    So the rule runs again whoever wrote the table, with or without a record by Snakemake.
    """
    path, record = results / "settings" / f"{table}.json", results / f"{table}.json"
    expected = json.loads(json.dumps(TypeAdapter(list[Sweep]).dump_python(list(sweeps))))
    recorded, written = _sweeps(record), _sweeps(path)
    content: dict[str, Any] = {"sweeps": expected}
    if recorded not in (None, expected):  # Snakemake compares what is in the file, too
        content["not_in"] = f"{record}, written at {record.stat().st_mtime_ns} ns"
    elif written == expected:
        return path
    text = json.dumps(content, indent=2) + "\n"
    if not path.exists() or path.read_text("utf-8") != text:
        write_whole(path, text.encode())
        if recorded == expected:  # older than the table, so that its rule does not run again
            os.utime(path, (0, 0))
    return path


def _sweeps(path: Path) -> Any:
    """Return the sweeps in a file of settings or a record; None where there are none."""
    try:
        return json.loads(path.read_bytes())["sweeps"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def split_override(override: str) -> tuple[str, str]:
    """Split ``key=value``."""
    key, equals, value = (part.strip() for part in override.partition("="))
    if not equals:
        raise ConfigError(f"{override!r} is not a setting; write key=value, such as trials=5")
    return key, value


def read_yaml(path: Path, schema: type[T]) -> T:
    """Read a YAML file, and check its keys and their types."""
    try:
        content = load_yaml(path)
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from None
    try:
        return TypeAdapter(schema).validate_python({} if content is None else content)
    except ValidationError as error:
        reasons = "; ".join(" ".join(problem).strip() for problem in problems(error)[:N_SHOWN])
        raise ConfigError(f"{path}: {reasons}") from None
