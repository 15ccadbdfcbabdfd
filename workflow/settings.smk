# What `--config` set, and the studies that come of it, each resolved where it is asked for.
from functools import cache
from pathlib import Path

from alignscores.registration.kernel import LIBRARY
from experiments.camera_errors import errors_of_scores
from experiments.command import ConfigError
from experiments.config import EXECUTION, load, to_overrides
from experiments.grid import cells
from studies.paper import FIGURES as PAPER_FIGURES
from studies.study import Table, found, plans


NOT_COMPILED = (
    "snakemake: note: the kernel of this version is not compiled, so trials take twice as long "
    "(to the same results); with a C compiler, run: pip install --no-build-isolation --no-deps -e ."
)


def or_end(resolve, *arguments):
    """Wrong settings end in one line, before any trial."""
    try:
        return resolve(*arguments)
    except ConfigError as error:
        sys.exit(f"snakemake: {error}")


GIVEN = to_overrides({key: config[key] for key in config if key not in EXECUTION})
EXECUTED = to_overrides({key: config[key] for key in EXECUTION if key in config and key != "n_jobs"})
RESULTS = Path(
    or_end(load, to_overrides({key: config[key] for key in EXECUTION if key in config}))[1].results_dir
)
CORES = workflow.cores or 1
STUDIES = or_end(plans, GIVEN)
FOLDERS = {plan.folder: plan for plan in STUDIES.values()}
EXPERIMENTS = sorted({name for names in PAPER_FIGURES.values() for name in names})


@cache
def planned(folder):
    """The names of the tables of trials in a folder that are needed."""
    return EXPERIMENTS if folder == "trials" else list(or_end(getattr, FOLDERS[folder], "tables"))


def tables(*studies):
    """The tables of trials of some studies, and the record beside each."""
    folders = [STUDIES[study].folder for study in studies]
    paths = [f"{RESULTS}/{folder}/{name}" for folder in folders for name in planned(folder)]
    return {"trials": expand("{path}.csv", path=paths), "records": expand("{path}.json", path=paths)}


def code(*folders):
    """Imported code is invisible to Snakemake's rerun logic unless it is an input."""
    files = [f"{folder}/*.{end}" for folder in folders for end in ("py", "c")]
    return sorted(path for pattern in files for path in Path(workflow.basedir).glob(pattern))


# What trials rest on, and what is asked of them: the rest of the library reads people's files.
PLOTS = Path(workflow.basedir) / "alignscores/plots.py"
TRIAL_CODE = code(
    "alignscores",
    "alignscores/protocols",
    "alignscores/registration",
    "baselines",
    "experiments",
    "experiments/scenes",
)
TRIAL_CODE.remove(PLOTS)
FIGURE_CODE = [PLOTS, *code("figures")]
