"""Scenarios of a file are composed and checked like experiments."""

import pytest

from experiments.config import ConfigError, load_sweep, to_overrides
from studies.beyond import plan, study_name


@pytest.fixture(scope="module")
def beyond():
    return sweeps()


def sweeps(**settings):
    return {name: load_sweep(to_overrides(table)) for name, table in plan(settings).items()}


def write(directory, text, name="mine.yaml"):
    path = directory / name
    path.write_text(text)
    return path


def test_a_file_of_your_own_takes_the_rest_from_beyond(tmp_path, beyond):
    path = write(
        tmp_path,
        "settings: {trials: 7, n_outliers: [0, 5], tas: {quantile: 0.9}}\n"
        "scenarios:\n"
        "  circle: {geometry: orbit}\n"
        "  pieces: {outliers: cluster, trials: 3}\n",
    )
    assert study_name(path) == "beyond_mine"
    circle, pieces = sweeps(scenarios=path, seed=4).values()
    assert (circle.name, circle.geometry, circle.trials) == ("beyond_mine/circle", "orbit", 7)
    assert (pieces.name, pieces.outliers, pieces.trials) == ("beyond_mine/pieces", "cluster", 3)
    for config in (circle, pieces):
        assert (config.seed, config.n_outliers) == (4, [0, 5])
        assert config.sigma_t == beyond["paper"].sigma_t
    quick = sweeps(scenarios=path, trials=1, tas={"order": 0.2})["pieces"]
    assert quick.trials == 1  # the command line wins
    assert (quick.tas.order, quick.tas.quantile) == (0.2, 0.9)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "scenarios is missing"),
        ("scenarios: {a: {}", "cannot be read"),
        ("scenarios: {a b: {}}", "scenarios has the key 'a b', which may have letters, digits and"),
        ("scenarios: {a: {geometry: sphere}}", "scenarios.a: setting 'geometry': must be one of"),
        ("scenarios: {a: {noise: product}}", "scenarios.a: needs noise=paired"),
        (
            "scenarios: {a: {output: x.csv}}",
            "scenarios.a may not set output, which holds for all studies",
        ),
        ("settings: {n_jobs: 1}\nscenarios: {a: {}}", "settings may not set n_jobs"),
        (
            "scenarios: {a: {sigma_t: [0.1], sigma_r_deg: [3], n_outliers: [0]}}",
            "scenarios.a: needs two levels of noise",
        ),
        ("scenarios: {a: {outliers: cluster, n_outliers: [99]}}", "at least 4 inliers"),
    ],
)
def test_a_file_at_fault_is_named_in_one_line(tmp_path, text, named):
    path = write(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        plan({"scenarios": path})
    assert named in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_whose_name_would_not_do_for_results_is_refused(tmp_path):
    path = write(tmp_path, "scenarios: {a: {}}", "my study.yaml")
    with pytest.raises(ConfigError, match="the name 'beyond_my study' may have letters"):
        plan({"scenarios": path})
