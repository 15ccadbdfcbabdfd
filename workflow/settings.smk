# What `--config` set, and the studies that come of it, each resolved where it is asked for.
from functools import cache, partial
from pathlib import Path

from alignscores.registration.kernel import LIBRARY
from experiments.camera_errors import errors_of_scores
from experiments.command import ConfigError
from experiments.config import EXECUTION, load, to_overrides
from experiments.grid import cells
from figures import FIGURES, PAPER_FIGURES
from report.pdf import browser
from studies.claims.claims import CLAIMS_FILE, load_claims
from studies.claims.plan import load_replicates
from studies.frame_rate.rates import load_frame_rate
from studies.order import load_halves
from studies.parameters.maps import MAPS, load_maps
from studies.parameters.axes import STUDIES, axis_names, load_parameters, study_file
from studies.scenarios.scenarios import BEYOND, load_scenarios, study_name
from studies.study import Table, load_experiments
from studies.today.questions import load_today


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


def chosen(keys):
    """The settings among these keys, as Hydra overrides."""
    return to_overrides({key: config[key] for key in keys if key in config})


AXES = axis_names()
SCENARIO_FILE = Path(config.get("scenarios", BEYOND))
SCENARIO_STUDY = study_name(SCENARIO_FILE)
EXPERIMENTS = sorted({name for names in PAPER_FIGURES.values() for name in names})
EXECUTED = chosen(key for key in EXECUTION if key != "n_jobs")
OWN_FILES = "scenarios", "trajectories"
NO_SETTINGS = *EXECUTION, *AXES, *OWN_FILES, "replicates"
SETTINGS = chosen(key for key in config if key not in NO_SETTINGS)
RESULTS = Path(or_end(load, chosen(EXECUTION))[1].results_dir)
CORES = workflow.cores or 1


@cache
def claims():
    return or_end(load_claims, config.get("replicates"))


FOLDERS = {  # of tables of trials: how to load the study that they are of
    "trials": partial(load_experiments, SETTINGS),
    "trials/halves": partial(load_halves, SETTINGS),
    "replicates": lambda: load_replicates(claims(), SETTINGS),
    **{
        f"trials/{name}_study": partial(load_parameters, name, [*chosen(AXES), *SETTINGS])
        for name in STUDIES
    },
    "trials/threshold_maps": partial(load_maps, [*chosen(AXES), *SETTINGS]),
    "trials/frame_rate": partial(load_frame_rate, SETTINGS),
    "trials/today": partial(load_today, SETTINGS),
    f"trials/{SCENARIO_STUDY}": partial(load_scenarios, SCENARIO_FILE, SETTINGS),
}


@cache
def study(folder):
    """The study whose tables of trials are in a folder."""
    return or_end(FOLDERS[folder])


def tables(*folders):
    """The tables of trials of some studies, and the record beside each."""
    names = {folder: EXPERIMENTS if folder == "trials" else study(folder).tables for folder in folders}
    paths = [f"{RESULTS}/{folder}/{name}" for folder in folders for name in names[folder]]
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
STUDY_CODE = code("studies", "studies/*")
FIGURE_CODE = [PLOTS, *code("figures", "studies", "studies/parameters", "studies/today")]
