"""Parameter studies: axes and parts, effects with their errors, tables and sentences."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments import registration_study, study, study_time, threshold_study
from experiments.config import ConfigError, load
from experiments.effects import EFFECTS, _jackknife, effects, read_parts, read_table, seeds_of
from experiments.statistics import dependence, power
from experiments.study import Study, axis_names, load_study
from experiments.sweep import sweep
from experiments.threshold_study import to_markdown

GRID = ["n_outliers=[0,3]", "sigma_t=[0.02,0.06]", "sigma_r_deg=[2,6]", "n_jobs=1"]
AXES = [
    "tas_max_threshold=[0.5]",
    "tas_quantile=[0.9]",
    "tas_n_thresholds=[inf]",
    "ras_max_threshold_deg=[5]",
    "ras_n_thresholds=[10]",
    "pas_weight=[1]",
    "registration_n_hypotheses=[30]",
    "registration_prescreen=[inf]",
    "registration_order=[0.3]",
]
SMALL = [*GRID, *AXES, "trials=3", "n_cameras=[20,30]"]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The overrides of a small threshold study whose parts have been run."""
    overrides = [*SMALL, f"results_dir={tmp_path_factory.mktemp('study')}"]
    for part in ("outliers", "majority", "length", "seeds"):
        assert study.main(["threshold", part, *overrides]) == 0
    assert study_time.main(["threshold", *overrides]) == 0
    assert threshold_study.main(overrides) == 0
    return overrides


@pytest.fixture(scope="module")
def small_study(results: list[str]) -> Study:
    return load_study("threshold", results)


@pytest.fixture(scope="module")
def table(small_study: Study) -> pd.DataFrame:
    return effects(small_study, read_parts(small_study))


def test_the_papers_values_are_the_defaults_of_the_library() -> None:
    # `Axis.column` leaves the option out, so a wrong value here would compare it with itself.
    axes = load_study("threshold").axes.values()
    written = {f"{axis.metric}({axis.option}={axis.paper})": axis.metric for axis in axes}
    assert len(written) == 9
    config = load(["experiment=outliers", "trials=1", "n_jobs=1", *GRID[:2]])
    trials = sweep(replace(config, metrics=[*written, "TAS", "RAS", "PAS"]))
    for metric, plain in written.items():
        assert (trials[metric] == trials[plain]).all()


def test_axes_and_their_values() -> None:
    axes = load_study("threshold").axes
    assert axes["tas_max_threshold"].values == ("0.25", "0.5", "1", "2", "4")
    assert axes["tas_n_thresholds"].values == ("5", "10", "100", "1000", "inf")
    assert axes["registration_prescreen"].values == ("0.03", "0.1", "0.3", "inf")
    assert load_study("registration").axes["tas_registration"].values == ("pcr99", "refined")


def test_an_axis_can_be_given_and_keeps_the_papers_value() -> None:
    given = load_study("threshold", ["tas_max_threshold=[3, 0.5]", "pas_weight=[0.2]"])
    assert given.axes["tas_max_threshold"].values == ("0.5", "1", "3")
    assert given.axes["pas_weight"].values == ("0.2", "0.5")
    assert "TAS(max_threshold=3)" in given.parts["outliers"].config.metrics
    assert "TAS(max_threshold=3, seed=9)" in given.parts["seeds"].config.metrics
    assert given.parts["outliers"].config.trials == 50


def test_a_value_counts_once_however_it_is_written() -> None:
    axes = load_study(
        "threshold", ["tas_max_threshold=[1.0,0.50,5e-1]", "registration_order=[0.1234567]"]
    ).axes
    assert axes["registration_order"].values == ("0.1", "0.1234567")
    assert axes["tas_max_threshold"].values == ("0.5", "1")


def test_axes_of_another_study_are_passed_over() -> None:
    assert set(axis_names()) > {"tas_max_threshold", "tas_registration"}
    load_study("registration", ["tas_max_threshold=[3]"])


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("tas_max_threshold=2", "'tas_max_threshold' must be a list in brackets"),
        ("tas_max_threshold=[2,]", "'tas_max_threshold' must be a list"),
        ("tas_max_threshold=[-2]", "max_threshold must be a positive number"),
        ("tas_max_treshold=[2]", "unknown setting 'tas_max_treshold'; the axes"),
        ("tas_max_threshold=[1.0]", "'tas_max_threshold' needs another value than the paper's 1"),
        ("tas_max_threshold=[two]", "max_threshold must be a positive number, not 'two'"),
        ("metrics=[TAS]", "unknown setting 'metrics'"),
        ("experiment=outliers", "unknown setting 'experiment'"),
        ("trials=0", "'trials'"),
        ("trials", "not a setting"),
    ],
)
def test_wrong_settings_end_in_one_line(
    override: str, named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for main, arguments in (
        (study.main, ["threshold", "outliers", override]),
        (study_time.main, ["threshold", override]),
        (threshold_study.main, [override]),
    ):
        assert main(arguments) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert named in line
    with pytest.raises(ConfigError, match="'tas_registration' needs another value than the"):
        load_study("registration", ["tas_registration=[pcr99]"])
    with pytest.raises(ConfigError, match="unknown study"):
        load_study("thresholds")
    assert study.main(["threshold", "lengths"]) == 2


def test_missing_trials_end_in_the_command_that_makes_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert threshold_study.main([f"results_dir={tmp_path}", "trials=3"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith(
        f"run: python -m experiments.study threshold outliers results_dir={tmp_path} trials=3"
    )
    assert not list(tmp_path.iterdir())


def test_trials_are_those_of_the_experiment(small_study: Study) -> None:
    config = load(["experiment=maa_vs_pas_outliers", *GRID, "trials=3", "n_cameras=[20,30]"])
    ours = read_parts(small_study)["outliers"]
    pd.testing.assert_series_equal(ours["PAS"], sweep(config)["PAS"], check_exact=True)
    assert {"TAS", "TAS(max_threshold=0.5)", "RAS(n_thresholds=10)"} <= set(ours)


def test_effects_are_the_statistics_of_the_trials(small_study: Study) -> None:
    trials = read_parts(small_study)
    # One number of cameras, so that a group is what shares the number of outliers.
    trials["outliers"] = trials["outliers"][trials["outliers"]["n_cameras"] == 20]
    table = effects(small_study, trials)
    assert len(table) == 18
    row = table[(table["axis"] == "tas_max_threshold") & (table["value"] == "0.5")].iloc[0]
    metric = "TAS(max_threshold=0.5)"
    outliers = trials["outliers"]
    expected = power(outliers, metric, ["sigma_t"], "mean")
    assert row["noise_power"] == pytest.approx(expected, abs=1e-6)
    expected = power(outliers, metric, ["n_outliers"], "smallest")
    assert row["outlier_power_smallest"] == pytest.approx(expected, abs=1e-6)
    expected = power(trials["majority"], metric, ["sigma_t"], "mean")
    assert row["majority_power"] == pytest.approx(expected, abs=1e-6)
    by_outliers = [group for _, group in outliers.groupby("n_outliers")]
    ranges = [np.ptp(group[metric]) for group in by_outliers]
    assert row["noise_range"] == pytest.approx(np.mean(ranges), abs=1e-6)
    ranges = [np.ptp(group.groupby("sigma_t")[metric].mean()) for group in by_outliers]
    assert row["noise_range_of_means"] == pytest.approx(np.mean(ranges), abs=1e-6)
    expected = dependence(trials["length"], metric, ["n_cameras"], "mean")
    assert row["camera_dependence"] == pytest.approx(expected, abs=1e-6)
    spread = [
        np.std([scene[f"TAS(max_threshold=0.5, seed={k})"] for k in range(10)], ddof=1)
        for _, scene in trials["seeds"].iterrows()
    ]
    assert row["seed_noise"] == pytest.approx(np.median(spread), abs=1e-6)
    assert (table.loc[table["metric"] == "RAS", "seed_noise"] == 0).all()


def test_the_papers_row_has_no_error_and_the_others_have(
    small_study: Study, table: pd.DataFrame
) -> None:
    errors = table[[f"{name}_error" for name in EFFECTS]]
    paper = table["paper"] == "yes"
    assert paper.sum() == 9
    assert errors[paper].isna().all(axis=None)
    assert errors[~paper].notna().all(axis=None)
    one = {name: part[part["trial"] == 0] for name, part in read_parts(small_study).items()}
    assert effects(small_study, one)[errors.columns].isna().all(axis=None)


def test_errors_are_those_of_the_difference_from_the_papers_value(small_study: Study) -> None:
    """Trials are paired: what scatters alike with either value is no error."""
    axis = small_study.axes["tas_max_threshold"]
    trials = read_parts(small_study)
    outliers = trials["outliers"] = trials["outliers"].copy()
    rng = np.random.default_rng(0)
    for other in (0.0, rng.normal(size=len(outliers))):
        outliers["TAS"] = outliers["sigma_t"] + rng.normal(size=len(outliers))
        outliers[axis.column("0.5")] = outliers["TAS"] + 0.1 + other
        table = effects(small_study, trials).set_index(["axis", "value"])
        differences = [
            np.subtract(
                *(
                    group.groupby("n_outliers")[column].agg(np.ptp).mean()
                    for column in (axis.column("0.5"), "TAS")
                )
            )
            for k in range(3)
            for group in [outliers[outliers["trial"] != k]]
        ]
        expected = np.sqrt(2 * np.var(differences))
        error = table["noise_range_error"]["tas_max_threshold", "0.5"]
        assert error == pytest.approx(expected, abs=1e-6)
        assert (error > 0.01) == np.any(other)


def test_a_score_that_rises_with_noise_has_no_power(small_study: Study) -> None:
    trials = read_parts(small_study)
    outliers = trials["outliers"]
    trials["outliers"] = outliers.assign(TAS=outliers["sigma_t"] + outliers["n_outliers"])
    row = effects(small_study, trials).set_index(["axis", "value"]).loc["tas_max_threshold", "1"]
    powers = [name for name in EFFECTS if name.endswith(("power", "power_smallest"))]
    assert (row[[name for name in powers if "majority" not in name]] < -0.7).all()


def test_what_does_not_vary_has_no_effect(small_study: Study) -> None:
    trials = read_parts(small_study)
    trials["outliers"] = trials["outliers"][trials["outliers"]["n_outliers"] == 0]
    trials["length"] = trials["length"][trials["length"]["n_cameras"] == 20]
    table = effects(small_study, trials)
    assert table[["outlier_power", "camera_dependence"]].isna().all(axis=None)
    assert table["noise_power"].notna().all()


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    sample = np.random.default_rng(0).normal(size=10)
    means = [np.delete(sample, i).mean() for i in range(10)]
    assert _jackknife(means) == pytest.approx(sample.std(ddof=1) / np.sqrt(10))


def test_sentences_tell_certain_differences_alone(small_study: Study, table: pd.DataFrame) -> None:
    table = table.copy()
    for name in EFFECTS:
        table[name], table[f"{name}_error"] = 0.5, 0.01
    row = (table["axis"] == "tas_quantile") & (table["value"] == "0.9")
    table.loc[row, ["noise_power", "outlier_power"]] = 0.7, 0.3
    table.loc[row, ["noise_range_of_means", "seed_noise"]] = 0.505, 0.3
    text = to_markdown(small_study, table, read_table(small_study, "_time"))
    (line,) = [line for line in text.splitlines() if "quantile" in line]
    costs, gains = line.split("*Gains:*")
    assert "τ with noise 0.500 instead of 0.700 at 0.9" in costs
    assert "seed noise 0.5000 instead of 0.3000 at 0.9" in costs
    assert "τ with outliers 0.500 against 0.300 at 0.9" in gains
    assert "range" not in line
    assert text.count("*Costs:* nothing that these trials can tell") == 8


def test_the_best_of_the_certain_values_is_told() -> None:
    """Not the very best, which may be so by chance, and not nothing because of that."""
    axis = load_study("threshold", ["tas_max_threshold=[0.5,2,4]"]).axes["tas_max_threshold"]
    table = pd.DataFrame({"axis": axis.name, "value": ["0.5", "1", "2", "4"]})
    for name in EFFECTS:
        table[name], table[f"{name}_error"] = 0.5, 0.01
    table["noise_power"] = [0.44, 0.5, 0.58, 0.6]
    table["noise_power_error"] = [0.01, np.nan, 0.01, 0.06]
    assert threshold_study.costs_and_gains(axis, table) == (
        ["τ with noise 0.500 instead of 0.580 at 2"],
        ["τ with noise 0.500 against 0.440 at 0.5"],
    )


def test_tables_come_back_bit_for_bit(results: list[str], small_study: Study) -> None:
    def tables() -> dict[str, bytes]:
        folder = small_study.results / "tables"
        return {path.name: path.read_bytes() for path in folder.iterdir()}

    before = tables()
    assert set(before) == {
        *(f"threshold_study_{kind}.csv" for kind in ("tas", "ras", "pas", "registration", "time")),
        "threshold_study.md",
    }
    assert study.main(["threshold", "outliers", *results, "n_jobs=2", "backend=threading"]) == 0
    assert threshold_study.main(results) == 0
    assert tables() == before


def test_times_are_of_every_value(small_study: Study) -> None:
    times = read_table(small_study, "_time")
    assert len(times) == 2 * 18
    assert (times["milliseconds"] > 0).all()


@pytest.fixture(scope="module")
def registrations(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return load_study("registration", [f"results_dir={tmp_path_factory.mktemp('registration')}"])


def test_registration_study_on_made_up_trials(registrations: Study) -> None:
    """The refined scores are made to lie 0.1 above the paper's, and to spread by 0.01."""
    refined = "TAS(registration=refined{})"
    seeds, length = registrations.parts["cube_37"], registrations.parts["trajectory_length"]
    few = replace(registrations, parts={"cube_37": seeds, "trajectory_length": length})
    spread = pd.DataFrame(
        {"n_cameras": 37, "n_outliers": [0, 11], "sigma_t": 0.03, "trial": 0}
        | {f"TAS(seed={k})": [0.4, 0.2 + 0.1 * (k % 2)] for k in range(10)}
        | {refined.format(f", seed={k}"): [0.5, 0.35 + 0.01 * (k % 2)] for k in range(10)}
    )
    cells = [(n, sigma) for n in (10, 20) for sigma in (0.01, 0.02, 0.03)]
    trials = pd.DataFrame(cells, columns=["n_cameras", "sigma_t"]).assign(
        n_outliers=0, sigma_r_deg=3.0
    )
    trials["TAS"] = [0.3, 0.1, 0.2, 0.6, 0.4, 0.2]
    trials[refined.format("")] = [0.5, 0.4, 0.3, 0.5, 0.4, 0.3]
    table = registration_study.compare(few, {"cube_37": spread, "trajectory_length": trials})

    def of(statistic: str, column: str) -> list[float]:
        return table.loc[table["statistic"] == statistic, column].round(6).tolist()

    deviation = np.sqrt(10 / 9) * 0.05
    assert of("mean", "pcr99") == [0.4, 0.25]
    assert of("mean", "refined") == [0.5, 0.355]
    assert of("standard deviation", "pcr99") == pytest.approx([0, deviation], abs=1e-6)
    assert of("standard deviation", "refined") == pytest.approx([0, deviation / 10], abs=1e-6)
    assert of("largest", "pcr99") == [0.4, 0.3]
    assert of("τ with noise", "pcr99") == pytest.approx([1 / 3, 1], abs=1e-6)
    assert of("τ with noise", "refined") == [1, 1]
    assert of("dependence on cameras, %", "refined") == [0]
    assert of("dependence on cameras, %", "pcr99") == [40.0]  # mean of 0.3, 0.3, 0 over 0.5

    times = pd.DataFrame({"n_cameras": 37, "axis": "tas_registration"}, index=[0, 1])
    times = times.assign(value=["pcr99", "refined"], milliseconds=[2.0, 5.0])
    text = registration_study.to_markdown(few, table, times)
    assert "higher on 2 of 2 inputs and lower on 0" in text
    assert "above 0.003 on 1 and 1 of them" in text
    assert "do not compare with published TAS values" in text
    assert "2.5 times as long" in text


def test_seeds_of_a_metric(registrations: Study) -> None:
    trials = pd.DataFrame({"TAS": [1], "TAS(seed=0)": [2], "TAS(seed=1)": [3], "RAS": [4]})
    assert list(seeds_of(trials, "TAS")) == ["TAS(seed=0)", "TAS(seed=1)"]
    assert seeds_of(trials, "RAS").empty


def test_inputs_of_the_registration_study(registrations: Study) -> None:
    """None, 30 %, 50 % and 90 % of the cameras are lost."""
    parts = [part for part in registrations.parts.values() if part.seeds]
    for part in parts:
        (n,) = part.config.n_cameras
        shares = [round(k / n, 2) for k in part.config.n_outliers]
        assert shares == pytest.approx([0, 0.3, 0.5, 0.9], abs=0.015)
        assert part.seeds == 10
        assert part.name == f"{part.config.geometry}_{n}"
    assert {part.name for part in parts} == {
        f"{geometry}_{n}" for geometry in ("cube", "line", "uneven") for n in (37, 100, 500)
    }
