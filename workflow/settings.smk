# What `--config` set, and the studies that come of it, each resolved where it is asked for.
from functools import cache
from itertools import chain
from pathlib import Path

from alignscores.texts import brief, printable
from experiments.command import CommandError, ConfigError
from experiments.config import EXECUTION, load, to_overrides
from experiments.grid import cells
from experiments.tables import check_sweeps
from studies.paper import FIGURES as PAPER_FIGURES
from studies.study import Table, found, plans


def or_end(resolve, *arguments):
    """Wrong settings end in one line, before any trial."""
    try:
        return resolve(*arguments)
    except CommandError as error:
        sys.exit(f"snakemake: {printable(str(error))}")


GIVEN = to_overrides({key: config[key] for key in config if key not in EXECUTION})
EXECUTED = to_overrides({key: config[key] for key in EXECUTION if key in config})
RESULTS = Path(or_end(load, EXECUTED)[1].results_dir)
try:
    (RESULTS / "trials").stat()
except FileNotFoundError:
    pass
except OSError as error:
    sys.exit(f"snakemake: cannot use results_dir={RESULTS}: {error.strerror}")
for key in ("scenarios", "benchmark"):
    if not isinstance(config.get(key, ""), str):
        sys.exit(f"snakemake: {key} needs the name of a file, not {printable(brief(config[key]))}")
CORES = workflow.cores or 1
STUDIES = or_end(plans, GIVEN)
FOLDERS = {plan.folder: plan for plan in STUDIES.values()}
EXPERIMENTS = sorted({name for names in PAPER_FIGURES.values() for name in names})


@cache
def planned(folder):
    """The names of the tables of trials in a folder that are needed."""
    return EXPERIMENTS if folder == "trials" else list(or_end(getattr, FOLDERS[folder], "tables"))


@cache
def resolved(folder, name):
    return or_end(lambda: FOLDERS[folder].tables[name])


def tables(*studies):
    """The tables of trials of some studies, and the record beside each."""
    folders = [STUDIES[study].folder for study in studies]
    paths = [f"{RESULTS}/{folder}/{name}.csv" for folder in folders for name in planned(folder)]
    return {"trials": paths, "records": [str(Path(path).with_suffix(".json")) for path in paths]}


def code(*folders, ends=("py", "c", "h")):
    """Imported code is invisible to Snakemake's rerun logic unless it is an input."""
    files = [f"{folder}/*.{end}" for folder in folders for end in ends]
    return sorted(path for pattern in files for path in Path(workflow.basedir).glob(pattern))


# What trials rest on, and what is asked of them: the rest of the library reads people's files.
PLOTS = Path(workflow.basedir) / "alignscores/plots.py"
TRIAL_CODE = code(
    "alignscores",
    "alignscores/protocols",
    "alignscores/registration",
    "alignscores/registration/kernel",
    "baselines",
    "experiments",
    "experiments/scenes",
)
TRIAL_CODE.remove(PLOTS)
FIGURE_CODE = [PLOTS, *code("figures")]
