"""Settings of an experiment: resolved from the Hydra configs, typed, checked before any trial."""

from ast import literal_eval
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from math import inf
from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.errors import HydraException
from omegaconf import MISSING, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from alignscores.registration import REGISTRATIONS

from .command import CommandError
from .errors import ERRORS
from .outliers import OUTLIERS
from .paths import PATHS

__all__ = [
    "CONFIG_DIR",
    "HOW",
    "METRICS",
    "METRIC_OPTIONS",
    "Config",
    "ConfigError",
    "experiment_names",
    "load",
    "result_settings",
    "split_metric",
    "to_overrides",
]

CONFIG_DIR = Path(__file__).resolve().parent.parent / "configs"
HOW = ("n_jobs", "backend", "dask_address", "results_dir")  # settings that no result depends on

NOISES = ("product", "paired")
ROTATION_STATISTICS = ("Median-1", "Mean-1", "RMS-1", "Median-2", "Mean-2", "RMS-2")
METRICS = ("ATE", "DTE", "mAA", "TAS", "RAS", "PAS", "DRE", *ROTATION_STATISTICS)

Check = tuple[str, Callable[[Any], bool]]  # what an option must be, and whether a value is
POSITIVE: Check = ("a positive number", lambda value: _is_number(value) and 0 < value < inf)
COUNT: Check = ("a positive whole number", lambda value: _is_whole(value) and value > 0)
STEPS: Check = (  # without end the staircase is a straight line: the exact area
    "a positive whole number or inf",
    lambda value: value == inf or (_is_whole(value) and value > 0),
)
SEED: Check = ("a whole number, not negative", lambda value: _is_whole(value) and value >= 0)
SHARE: Check = ("above 0, at most 1", lambda value: _is_number(value) and 0 < value <= 1)
REGISTRATION: Check = (" or ".join(REGISTRATIONS), lambda value: value in REGISTRATIONS)
METRIC_OPTIONS: Mapping[str, Mapping[str, Check]] = {
    "mAA": {
        "max_threshold_deg": POSITIVE,
        "n_thresholds": COUNT,
        "fold_sign": ("True or False", lambda value: isinstance(value, bool)),
    },
    "TAS": {
        "max_threshold": POSITIVE,
        "n_thresholds": STEPS,
        "quantile": SHARE,  # of the closest-pair distances, that is d
        "registration": REGISTRATION,
        "n_hypotheses": COUNT,
        "prescreen": ("a positive number or inf", lambda value: _is_number(value) and value > 0),
        "order": SHARE,  # of the cameras, that is m
        "seed": SEED,  # of the registration, beside that of the trial
    },
    "RAS": {"max_threshold_deg": POSITIVE, "n_thresholds": STEPS},
    "PAS": {
        "weight": ("from 0 to 1", lambda value: _is_number(value) and 0 <= value <= 1),
        "registration": REGISTRATION,
        "seed": SEED,
    },
}
PCR99_OPTIONS = ("prescreen", "order")
BACKENDS = ("loky", "threading", "sequential", "dask")
CHOICES: Mapping[str, Iterable[str]] = {  # the settings that are one of a few words
    "geometry": PATHS,
    "error": ERRORS,
    "outliers": OUTLIERS,
    "noise": NOISES,
    "backend": BACKENDS,
}


class ConfigError(CommandError):
    """A setting that is missing, mistyped or impossible."""

    exit_code = 2


@dataclass
class Config:
    """One experiment. The keys and their meaning stand in ``configs/``."""

    name: str = MISSING
    geometry: str = MISSING
    error: str = MISSING
    outliers: str = MISSING
    outlier_side: float = MISSING
    volume_per_camera: float | None = MISSING
    n_cameras: list[int] = MISSING
    n_outliers: list[int] = MISSING
    sigma_t: list[float] = MISSING
    sigma_r_deg: list[float] = MISSING
    noise: str = MISSING
    metrics: list[str] = MISSING
    trials: int = MISSING
    seed: int = MISSING
    replicate: int = MISSING
    n_jobs: int = MISSING
    backend: str = MISSING
    dask_address: str | None = MISSING
    results_dir: str = MISSING


def experiment_names() -> list[str]:
    """Return the names of all experiments: one YAML file each."""
    return sorted(path.stem for path in (CONFIG_DIR / "experiment").glob("*.yaml"))


def load(overrides: Sequence[str] = ()) -> Config:
    """Resolve the configuration of one experiment.

    Parameters
    ----------
    overrides : sequence of str
        Hydra overrides such as ``"experiment=collinear"``, ``"trials=5"``, ``"sigma_t=[0.05]"``.

    Returns
    -------
    Config
        The resolved and checked settings.

    Raises
    ------
    ConfigError
        In one line that names the key, where a value is missing, mistyped or impossible.

    Examples
    --------
    >>> from experiments.config import load
    >>> config = load(["experiment=outliers", "trials=5"])
    >>> config.name, config.trials, config.n_cameras
    ('outliers', 5, [100])
    """
    experiment = _check_overrides(overrides)
    try:
        GlobalHydra.instance().clear()
        with initialize_config_dir(config_dir=str(CONFIG_DIR), version_base="1.3"):
            composed = compose(config_name="config", overrides=list(overrides))
        config = OmegaConf.to_object(OmegaConf.merge(OmegaConf.structured(Config), composed))
    except OmegaConfBaseException as error:
        reason = str(error.msg or error).splitlines()[0]
        if "ListConfig" in reason:
            reason = "must be a list in brackets, for example [1, 2]"
        raise ConfigError(f"setting {error.full_key!r}: {reason}") from None
    except (HydraException, ValueError) as error:
        reason = " ".join(str(error).partition("See https")[0].split())
        raise ConfigError(f"cannot read {' '.join(overrides)}: {reason}") from None
    assert isinstance(config, Config)
    _check(config)
    named = experiment in (None, config.name)
    _require(named, "name", f"must be {experiment!r} as the file: its results are called so")
    return config


def result_settings(config: Config) -> dict[str, Any]:
    """Return the settings that results depend on: all but `HOW`.

    Examples
    --------
    >>> from experiments.config import load, result_settings
    >>> settings = result_settings(load(["trials=5", "n_jobs=1"]))
    >>> settings["trials"], "n_jobs" in settings
    (5, False)
    """
    return {key: value for key, value in asdict(config).items() if key not in HOW}


def split_metric(metric: str) -> tuple[str, dict[str, Any]]:
    """Split a metric with options of its own into its name and these options.

    Raises
    ------
    ConfigError
        Where there is no such metric or option, or the option cannot have the value.

    Examples
    --------
    >>> from experiments.config import split_metric
    >>> split_metric("TAS(max_threshold=0.5, n_thresholds=10)")
    ('TAS', {'max_threshold': 0.5, 'n_thresholds': 10})
    >>> split_metric("TAS(registration=refined, n_thresholds=inf)")
    ('TAS', {'registration': 'refined', 'n_thresholds': inf})
    """
    name, bracket, inside = metric.partition("(")
    if name not in METRICS:
        raise ConfigError(f"unknown metric {metric!r}; known are {', '.join(METRICS)}")
    if not bracket:
        return name, {}
    options = {}
    for option in inside.removesuffix(")").split(","):
        key, _, value = (part.strip() for part in option.partition("="))
        known = METRIC_OPTIONS.get(name, {})
        if key not in known or not inside.endswith(")"):
            choice = ", ".join(known) or "none"
            raise ConfigError(f"metric {metric!r} has no option {key!r}; the options are {choice}")
        requirement, fits = known[key]
        options[key] = _option_value(value)
        if not fits(options[key]):
            raise ConfigError(f"metric {metric!r}: {key} must be {requirement}, not {value!r}")
    if options.get("registration") == "refined" and not options.keys().isdisjoint(PCR99_OPTIONS):
        raise ConfigError(f"metric {metric!r}: {' and '.join(PCR99_OPTIONS)} belong to pcr99 alone")
    return name, options


def _option_value(text: str) -> Any:
    """Read a number, True, False, inf or a word."""
    try:
        return inf if text == "inf" else literal_eval(text)
    except (ValueError, SyntaxError):
        return text


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(value: Any) -> bool:
    return isinstance(value, float) or _is_whole(value)


def to_overrides(settings: Mapping[str, Any]) -> list[str]:
    """Turn the settings of ``snakemake --config`` into Hydra overrides.

    Examples
    --------
    >>> from experiments.config import to_overrides
    >>> to_overrides({"trials": 5, "sigma_t": ["0.05", "0.1"], "volume_per_camera": None})
    ['trials=5', 'sigma_t=[0.05,0.1]', 'volume_per_camera=null']
    """
    return [f"{key}={_hydra_value(value)}" for key, value in settings.items()]


def _hydra_value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{','.join(map(_hydra_value, value))}]"
    if isinstance(value, str) and value.endswith(")"):  # a metric with options, no Hydra function
        return f"'{value}'"
    return "null" if value is None else str(value)


def _check_overrides(overrides: Sequence[str]) -> str | None:
    """Refuse unknown keys and experiments here, where the choice can be named in one line.

    Returns the experiment that is chosen.
    """
    known = ["experiment", *(field.name for field in fields(Config) if field.name != "name")]
    experiments = []
    for override in overrides:
        key, equals, value = (part.strip() for part in override.partition("="))
        if not equals:
            raise ConfigError(f"{override!r} is not a setting; write key=value, such as trials=5")
        if key not in known:
            raise ConfigError(f"unknown setting {key!r}; the settings are {', '.join(known)}")
        if key == "experiment" and value not in experiment_names():
            names = ", ".join(experiment_names())
            raise ConfigError(f"unknown experiment {value!r}; the experiments are {names}")
        experiments += [value] if key == "experiment" else []
    if len(experiments) > 1:
        raise ConfigError(f"setting 'experiment' is given twice: {' and '.join(experiments)}")
    return experiments[0] if experiments else None


def _check(config: Config) -> None:
    """Refuse settings that no trial could be run with."""
    for key in ("n_cameras", "n_outliers", "sigma_t", "sigma_r_deg", "metrics"):
        values = getattr(config, key)
        _require(len(values) > 0, key, "needs at least one value")
        _require(len(set(values)) == len(values), key, f"has a value twice: {values}")
    for key, choices in CHOICES.items():
        _require(getattr(config, key) in choices, key, f"must be one of {', '.join(choices)}")
    _require(
        config.backend != "dask" or bool(config.dask_address),
        "dask_address",
        "must name a scheduler, such as tcp://127.0.0.1:8786, for the backend dask",
    )
    for metric in config.metrics:
        split_metric(metric)

    _require(min(config.n_cameras) >= 4, "n_cameras", "must be at least 4, or TAS is undefined")
    _require(min(config.n_outliers) >= 0, "n_outliers", "must not be negative")
    _require(
        max(config.n_outliers) <= min(config.n_cameras),
        "n_outliers",
        f"has {max(config.n_outliers)}, more than the {min(config.n_cameras)} cameras",
    )
    _require(
        config.outliers == "uniform" or max(config.n_outliers) <= min(config.n_cameras) - 4,
        "n_outliers",
        f"must leave at least 4 cameras that are none, where outliers are {config.outliers}",
    )
    _require(0 < config.outlier_side < inf, "outlier_side", "must be positive")
    for key in ("sigma_t", "sigma_r_deg"):
        levels = getattr(config, key)
        _require(all(0 <= level < inf for level in levels), key, "must be finite and not negative")
    _require(
        config.noise == "product" or len(config.sigma_t) == len(config.sigma_r_deg),
        "noise",
        "is paired, so sigma_t and sigma_r_deg need the same number of levels",
    )
    if config.volume_per_camera is not None:
        _require(0 < config.volume_per_camera < inf, "volume_per_camera", "must be positive")
        _require(config.geometry == "cube", "volume_per_camera", "applies to the cube alone")
    _require(bool(config.results_dir), "results_dir", "must name a folder")
    _require(config.trials >= 1, "trials", f"must be at least 1, not {config.trials}")
    _require(config.seed >= 0, "seed", "must not be negative")
    _require(config.replicate >= 0, "replicate", "must not be negative")
    _require(config.n_jobs >= 1 or config.n_jobs == -1, "n_jobs", "must be positive, or -1 for all")


def _require(condition: bool, key: str, requirement: str) -> None:
    if not condition:
        raise ConfigError(f"setting {key!r} {requirement}")
