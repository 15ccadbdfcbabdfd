# What `--config` sets, and what rules depend on.
import shlex
import sys
from functools import cache
from hashlib import sha256
from math import ceil
from pathlib import Path

from snakemake.exceptions import WorkflowError

ROOT = Path(workflow.basedir)
sys.path.insert(0, str(ROOT))
shell.prefix(f"PATH={shlex.quote(str(Path(sys.executable).parent))}:$PATH; ")  # so that `python` is this one

from experiments.command import CommandError
from experiments.config import EXECUTION, load, to_overrides
from experiments.tables import SWEEPS
from studies.beyond import SCENARIOS, study_name
from studies.claims.claims import load_claims
from studies.claims.plan import replicates
from studies.real.scores import read_benchmark, sources
from studies.study import find_studies

STUDIES = find_studies()
STUDY_KEYS = {key for study in STUDIES.values() for key in study.keys}
CONFIG = to_overrides({key: value for key, value in config.items() if key not in EXECUTION})
SETTINGS = {key: value for key, value in config.items() if key not in {*EXECUTION, *STUDY_KEYS}}
MORE = ",".join(config["more"]) if isinstance(config.get("more"), list) else config.get("more", "")
FOLDER = {key: config[key] for key in ["results_dir"] if key in config}
try:
    sweep, execution = load(to_overrides({**SETTINGS, **FOLDER}))  # a wrong key or value ends here
    BEYOND = study_name(Path(config.get("scenarios", SCENARIOS)))
except CommandError as error:
    raise WorkflowError(str(error)) from None
RESULTS = Path(execution.results_dir)
THREADS = config.get("n_jobs", 1) if config.get("n_jobs") != -1 else workflow.cores


def code(*folders, ends=("py", "c", "h")):
    """Return the files of some folders: what Python imports is an input like any other."""
    return sorted(path for folder in folders for end in ends for path in (ROOT / folder).glob(f"*.{end}"))


TRIAL_CODE = code(
    *("alignscores", "alignscores/protocols", "alignscores/registration", "alignscores/registration/kernel"),
    *("baselines", "experiments", "experiments/scenes"),
)
FIGURE_CODE = [*TRIAL_CODE, ROOT / "alignscores" / "show" / "plots.py", *code("figures")]

EXPERIMENTS = sorted(glob_wildcards(ROOT / "configs" / "experiment" / "{name}.yaml").name)
PAPER_TRIALS = expand(RESULTS / "trials" / "{experiment}.csv", experiment=EXPERIMENTS)


@cache
def tables_of(study):
    """Return the settings of each table of trials of a study."""
    own = {key: config[key] for key in STUDIES[study].keys if key in config}
    return STUDIES[study].plan({**SETTINGS, **own})


def trials_of(study):
    """Return the tables of trials of a study."""
    return [RESULTS / "trials" / (BEYOND if study == "beyond" else study) / f"{name}.csv" for name in tables_of(study)]


def settings_of(wildcards):
    """Return the settings of a table of trials of a study."""
    return tables_of("beyond" if wildcards.study == BEYOND else wildcards.study)[wildcards.table]


def experiment_file(settings):
    return ROOT / "configs" / "experiment" / f"{settings['experiment']}.yaml"


@cache
def sweeps_of_replicates():
    """Return the sweeps of each replicate study."""
    claims = load_claims(config.get("replicates"))
    return replicates(claims, to_overrides(SETTINGS), range(claims.replicates))


def digest_of_replicate(number):
    """Return a short text that changes with what the claims need."""
    return sha256(SWEEPS.dump_json(sweeps_of_replicates()[number])).hexdigest()


def memory(wildcards, threads):
    """Return twice the megabytes that were measured (docs/how-to/parameter-study.md)."""
    return 600 + 300 * threads + sweep.trials


def minutes(wildcards, threads):
    """Return nine times what was measured, and ten minutes for slow nodes and file systems."""
    return 10 + ceil(14 * sweep.trials / 60 / threads)


@cache
def own_runs():
    """Return the sequences of your own benchmark, each with the files of its runs."""
    if "benchmark" not in config:
        raise WorkflowError("snakemake real needs --config benchmark=FILE")
    benchmark = read_benchmark(Path(config["benchmark"]))
    return {sequence: sources(benchmark, sequence) for sequence in benchmark.references}
