"""Settings can all be overridden, and wrong ones end in one line."""

from typing import Any

import numpy as np
import pytest

from experiments.config import ConfigError, load, load_sweep, read_yaml, to_overrides


def test_the_outlier_experiment_has_the_values_of_the_paper():
    sweep = load_sweep(["experiment=outliers"])
    levels = pytest.approx(np.arange(1, 11) / 100)
    assert (sweep.trials, sweep.n_cameras, sweep.sigma_r_deg) == (50, [100], [3.0])
    assert sweep.sigma_t == levels
    assert sweep.metrics == ["ATE", "DTE", "mAA", "TAS"]


@pytest.mark.parametrize(
    ("override", "problem"),
    [
        ("trails=5", "cannot read experiment=outliers trails=5: Could not override 'trails'; did"),
        ("trials", "cannot read experiment=outliers trials: Error parsing override 'trials'; run:"),
        ("experiment=oultiers", "did you mean outliers?"),
        ("tas.max_treshold=5", "did you mean tas.max_threshold?"),
        ("trials=five", "'trials': should be a valid integer, not 'five'"),
        ("trials=0", "'trials': should be greater than or equal to 1, not 0"),
        ("n_jobs=0", "'n_jobs': must be positive, or -1 for all"),
        ("geometry=sphere", "'geometry': must be one of cube, line, ray, x_axis, random_walk, "),
        ("geometry=orbits", "uneven, not 'orbits'; did you mean orbit?"),
        ("error=gausian", "not 'gausian'; did you mean gaussian?"),
        ("metrics=[TAS(max_threshold=2)]", "quote names with brackets: \"metrics=[TAS,'TAS(max_t"),
        ("noise=both", "'noise': should be 'product' or 'paired', not 'both'"),
        ("noise=paired", "'noise' is paired, so sigma_t and sigma_r_deg need the same number"),
        ("sigma_t=0.1", "'sigma_t': must be a list in brackets, for example [1, 2]"),
        ("sigma_t=[]", "'sigma_t': needs 1 or more entries, not []"),
        ("sigma_t=[0.1", "cannot read experiment=outliers sigma_t=[0.1: "),
        ("sigma_t=[nan]", "'sigma_t': should be a finite number, not nan"),
        ("sigma_t=[1e200]", "'sigma_t': should be less than or equal to 1000000, not 1e+200"),
        ("sigma_t=[0.1,0.1]", "'sigma_t': has a value twice: [0.1, 0.1]"),
        ("n_cameras=9,10", "n_cameras=9,10"),
        ("n_outliers=[101]", "'n_outliers' has 101, more than the 100 cameras"),
        ("every=26", "'every' leaves fewer than 4 of the 100 cameras"),
        ("metrics=[ATE,APE]", "'metrics': unknown metric 'APE'; close to it are ATE"),
    ],
)
def test_wrong_settings_are_named_in_one_line(override, problem):
    with pytest.raises(ConfigError) as caught:
        load(["experiment=outliers", override])
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("outliers", ["cluster", "frozen", "diverging", "missing"])
def test_outliers_that_leave_too_few_cameras_are_refused(outliers):
    settings = ["experiment=outliers", f"outliers={outliers}", "n_cameras=[20]"]
    assert load_sweep([*settings, "n_outliers=[16]"]).outliers == outliers
    with pytest.raises(
        ConfigError, match=f"'n_outliers' must leave at least 4 .* outliers={outliers}"
    ):
        load([*settings, "n_outliers=[17]"])


def test_snakemake_settings_reach_hydra():
    # Snakemake reads lists as strings and an empty value as None.
    fine = "TAS(max_threshold=0.5, n_thresholds=10)"
    settings = {"trials": 5, "sigma_t": ["0.05", "0.1"], "volume_per_camera": None}
    settings["tas"] = {"prescreen": "inf"}
    sweep = load_sweep(
        ["experiment=outliers", *to_overrides(settings | {"metrics": ["ATE", fine]})]
    )
    assert (sweep.trials, sweep.sigma_t, sweep.volume_per_camera) == (5, [0.05, 0.1], None)
    assert sweep.tas["prescreen"] == np.inf
    assert sweep.metrics == ["ATE", fine]


@pytest.mark.parametrize("text", [None, "[", "5", "- {}\n- []"])
def test_a_broken_file_of_settings_is_named_in_one_line(tmp_path, text):
    path = tmp_path / "own.yaml"
    if text is not None:
        path.write_text(text)
    problem = rf"{path}: (cannot be read[: (]+.|needs key: value)"
    with pytest.raises(ConfigError, match=problem) as caught:
        read_yaml(path, dict[str, Any])
    assert "\n" not in str(caught.value)
