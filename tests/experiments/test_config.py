"""Settings are those of the paper, can all be overridden, and are refused in one line."""

import shutil
from pathlib import Path

import pytest

from experiments import config as config_module
from experiments.config import ConfigError, experiment_names, load, to_overrides
from experiments.sweep import cells

TEN_LEVELS = [0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08, 0.09, 0.1]


def test_the_eight_experiments_of_the_paper_are_there() -> None:
    grids = {name: len(cells(load([f"experiment={name}"]))) for name in experiment_names()}
    assert grids == {
        "collinear": 70,
        "combined": 50,
        "maa_vs_pas_collinear": 70,
        "maa_vs_pas_length": 70,
        "maa_vs_pas_outliers": 70,
        "outliers": 70,
        "rotations": 70,
        "trajectory_length": 70,
    }


def test_a_copied_experiment_needs_a_name_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else its results would take the place of the original's."""
    shutil.copytree(config_module.CONFIG_DIR, tmp_path / "configs")
    monkeypatch.setattr(config_module, "CONFIG_DIR", tmp_path / "configs")
    folder = tmp_path / "configs" / "experiment"
    text = (folder / "outliers.yaml").read_text()
    (folder / "mine.yaml").write_text(text)
    with pytest.raises(ConfigError, match="setting 'name' must be 'mine'"):
        load(["experiment=mine"])
    (folder / "mine.yaml").write_text(text.replace("name: outliers", "name: mine"))
    assert load(["experiment=mine"]).name == "mine"


@pytest.mark.parametrize("name", experiment_names())
def test_defaults_hold_for_every_experiment(name: str) -> None:
    config = load([f"experiment={name}"])
    assert (config.name, config.trials, config.replicate) == (name, 50, 0)


def test_outlier_experiment_has_the_values_of_the_paper() -> None:
    config = load(["experiment=outliers"])
    assert config.n_cameras == [100]
    assert config.sigma_t == TEN_LEVELS
    assert config.sigma_r_deg == [3.0]
    assert config.metrics == ["ATE", "DTE", "mAA", "TAS"]


def test_noise_rises_together_where_it_is_paired() -> None:
    config = load(["experiment=maa_vs_pas_outliers", "n_outliers=[0]"])
    assert [round(100 * cell.sigma_t) for cell in cells(config)] == list(range(1, 11))
    assert [cell.sigma_r_deg for cell in cells(config)] == list(range(1, 11))


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("trails=5", "trails"),
        ("trials", "trials"),
        ("=5", "unknown setting ''"),
        ("trials=five", "trials"),
        ("trials=2.5", "trials"),
        ("trials=null", "trials"),
        ("trials=0", "trials"),
        ("experiment=collinear", "'experiment' is given twice"),
        ("name=other", "name"),
        ("results_dir=", "results_dir"),
        ("seed=-1", "seed"),
        ("replicate=-1", "replicate"),
        ("n_jobs=0", "n_jobs"),
        ("backend=mpi", "backend"),
        ("backend=dask", "dask_address"),
        ("geometry=sphere", "geometry"),
        ("error=none", "error"),
        ("outliers=many", "outliers"),
        ("outlier_side=0", "outlier_side"),
        ("outlier_side=inf", "outlier_side"),
        ("noise=both", "noise"),
        ("noise=paired", "noise"),
        ("sigma_t=0.1", "sigma_t"),
        ("sigma_t=[]", "sigma_t"),
        ("sigma_t=[0.1", "sigma_t"),
        ("sigma_t=[-0.1]", "sigma_t"),
        ("sigma_t=[nan]", "sigma_t"),
        ("sigma_r_deg=[inf]", "sigma_r_deg"),
        ("sigma_t=[0.1,0.1]", "sigma_t"),
        ("n_outliers=[101]", "n_outliers"),
        ("n_outliers=[-1]", "n_outliers"),
        ("n_outliers=[1.5]", "n_outliers"),
        ("n_cameras=[3]", "n_cameras"),
        ("volume_per_camera=0", "volume_per_camera"),
        ("metrics=[ATE,APE]", "APE"),
        ("experiment=oultiers", "oultiers"),
    ],
)
def test_wrong_settings_are_named_in_one_line(override: str, named: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load(["experiment=outliers", override])
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", ["cluster", "frozen", "diverging", "missing"])
def test_outliers_that_leave_too_few_cameras_are_refused(kind: str) -> None:
    settings = ["experiment=outliers", f"outliers={kind}", "n_cameras=[20]"]
    assert load([*settings, "n_outliers=[16]"]).outliers == kind
    with pytest.raises(ConfigError, match="'n_outliers' must leave at least 4 cameras"):
        load([*settings, "n_outliers=[17]"])


@pytest.mark.parametrize("name", experiment_names())
def test_the_papers_experiments_have_its_errors_and_outliers(name: str) -> None:
    config = load([f"experiment={name}"])
    assert (config.error, config.outliers, config.outlier_side) == ("gaussian", "uniform", 10.0)


def test_a_volume_without_a_cube_is_refused() -> None:
    with pytest.raises(ConfigError, match="volume_per_camera"):
        load(["experiment=collinear", "volume_per_camera=0.1"])


def test_snakemake_settings_reach_hydra() -> None:
    # Snakemake reads lists as strings and an empty value as None.
    settings = {"trials": 5, "sigma_t": ["0.05", "0.1"], "volume_per_camera": None}
    config = load(["experiment=outliers", *to_overrides(settings)])
    assert (config.trials, config.sigma_t, config.volume_per_camera) == (5, [0.05, 0.1], None)
