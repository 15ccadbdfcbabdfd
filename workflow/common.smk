# What `--config` sets, and what rules depend on.
import shlex
import sys
from math import ceil
from pathlib import Path

from snakemake.exceptions import WorkflowError

ROOT = Path(workflow.basedir)
sys.path.insert(0, str(ROOT))
shell.prefix(f"PATH={shlex.quote(str(Path(sys.executable).parent))}:$PATH; ")  # so that `python` is this one

from experiments.command import CommandError
from experiments.config import EXECUTION, load, to_overrides
from studies.study import plans

GIVEN = to_overrides({key: value for key, value in config.items() if key not in EXECUTION})
STUDIES = plans(GIVEN)  # by their names, each with the settings that concern it
SETTINGS = STUDIES["paper"].overrides
FOLDER = to_overrides({key: config[key] for key in ["results_dir"] if key in config})
try:
    sweep, execution = load([*SETTINGS, *FOLDER])  # a wrong key or value ends here
    BEYOND = STUDIES["beyond"].called
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
TRIAL_CODE.remove(ROOT / "alignscores" / "plots.py")
FIGURE_CODE = [*TRIAL_CODE, ROOT / "alignscores" / "plots.py", *code("figures")]

EXPERIMENTS = sorted(glob_wildcards(ROOT / "configs" / "experiment" / "{name}.yaml").name)
PAPER_TRIALS = expand(RESULTS / "trials" / "{experiment}.csv", experiment=EXPERIMENTS)


def trials_of(study):
    """Return the tables of trials of a study; their records are its inputs, too."""
    return [RESULTS / STUDIES[study].folder / f"{table}.csv" for table in STUDIES[study].tables]


def study_of(folder):
    return "beyond" if folder == BEYOND else folder


def memory(wildcards, threads):
    """Return twice the megabytes that were measured (docs/how-to/cluster.md)."""
    return 600 + 300 * threads + sweep.trials


def minutes(wildcards, threads):
    """Return nine times what was measured, and ten minutes for slow nodes and file systems."""
    return 10 + ceil(14 * sweep.trials / 60 / threads)


def own_runs():
    """Return the sequences of your own benchmark, each with the files of its runs."""
    if "benchmark" not in config:
        raise WorkflowError("snakemake real needs --config benchmark=FILE")
    return STUDIES["real"].sources
