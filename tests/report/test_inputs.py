"""A file at fault ends in one line that names it with the remedy, and the old page stays."""

import pytest

from report.__main__ import main


def put(content):
    return lambda path: path.write_text(content)


def lose(path):
    path.unlink()


def cut(path):
    path.write_bytes(path.read_bytes()[:60])


def swap(old, new):
    def change(path):
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))

    return change


VERDICTS, READINGS, TABLE_1 = "claims.csv", "tables/readings.csv", "tables/method_comparison.csv"
THRESHOLDS, TIMES = "tables/threshold_study_{}.csv", "tables/{}_study_time.csv"
REGISTRATIONS, FINDINGS = "tables/registration_study.csv", "tables/beyond.csv"
TODAY = "tables/today.csv"
FAULTS = [
    (VERDICTS, lose, "does not exist"),
    (VERDICTS, put(""), "cannot be read (No columns"),
    (VERDICTS, put("a,b\n1,2\n"), "has no column id"),
    (VERDICTS, swap(",-74.0,", ",-75.0,"), "has the paper -75.0, not -74.0"),
    (VERDICTS, swap("ATE discerns", "ATE shows"), "line 2 has the statement Without outliers the"),
    (VERDICTS, swap(",3,", ",4,"), "line 2 has the replicates 4, not 3"),
    (VERDICTS, swap(",reproduced", ",yes"), "has an unknown verdict 'yes'"),
    (VERDICTS, swap(",0.3,", ",x,"), "cannot be read (could not convert string to float: 'x')"),
    (VERDICTS, swap(",0.3,", ",,"), "lacks values of ours"),
    (VERDICTS, swap(",0.3,", ",inf,"), "lacks values of ours"),
    (VERDICTS, swap(",true", ",yes"), "has an unknown population 'yes'"),
    (VERDICTS, swap("volume 10 n", "volume"), "has no column volume: volume 10 n"),
    (READINGS, lose, "does not exist"),
    (READINGS, swap("mean curve", "median"), "has the reading median, not mean curve"),
    (READINGS, swap(",reproduced", ","), "has an unknown verdict nan"),
    ("tables/order.csv", lose, "does not exist"),
    ("tables/order.csv", swap("90", ""), "lacks values of order"),
    (TABLE_1, lose, "does not exist"),
    (TABLE_1, swap("TAS", "XAS"), "line 18 has the metric XAS, not TAS"),
    (TABLE_1, swap("0.25", ""), "lacks values of value"),
    ("figures/combined.png", lose, "does not exist"),
    ("figures/combined.png", put("GIF89a"), "is not a PNG"),
    ("figures/combined.png", cut, "is not a PNG"),
    (THRESHOLDS.format("ras"), lose, "does not exist"),
    (THRESHOLDS.format("tas"), swap(",yes,", ",no,"), "line 4 has the paper no, not yes"),
    (THRESHOLDS.format("pas"), swap("0.25", "0.3"), "line 3 has the value 0.3, not 0.25"),
    (THRESHOLDS.format("pas"), swap("0.5,", ","), "lacks values of noise_power"),
    (THRESHOLDS.format("registration"), swap("registration_order,0.5,no", ""), "line 16 has"),
    (TIMES.format("threshold"), lose, "does not exist"),
    (TIMES.format("registration"), swap("1.25", "x"), "cannot be read (could not convert"),
    (TIMES.format("registration"), swap("1.25", ""), "lacks values of milliseconds"),
    (TIMES.format("registration"), swap("500,", "501,"), "line 6 has the n_cameras 501, not 500"),
    (REGISTRATIONS, put("part\n"), "has no column geometry"),
    (REGISTRATIONS, swap("line_37", "line_38"), "was made for something else: see part line_38"),
    (REGISTRATIONS, swap("0.625", ""), "lacks values of refined"),
    (FINDINGS, lose, "does not exist"),
    (FINDINGS, swap("orbit,RAS", "orbit,SAR"), "has the metric SAR, not RAS"),
    (FINDINGS, put("scenario,metric,noise_power,outlier_power,finding,mean\n"), "has 0 rows, not"),
    (TODAY, swap("outliers,noise,,,TAS,", "outliers,noise,,,ATE,"), "see outliers TAS"),
    (TODAY, swap("80,", ","), "lacks values of order"),
    ("trials/threshold_study/length.json", lose, "does not exist"),
    ("trials/beyond/bias.json", put("{"), "is not the record"),
    ("trials/rotations.json", lose, "does not exist"),
    ("replicates/1.json", put("{"), "is not the record of a table of trials"),
    ("replicates/1.json", swap('"replicate": 1', '"replicate": 2'), "is not replicate 1"),
    ("replicates/2.json", swap('"trials": 7', '"trials": 5'), "has other settings than "),
]


@pytest.mark.parametrize(("name", "change", "problem"), FAULTS)
def test_a_file_at_fault_is_named_with_the_remedy(results, capsys, name, change, problem):
    results.html.write_text("the old page")
    path = results.folder / name
    change(path)
    assert main(results.arguments()) == 1
    out, err = capsys.readouterr()
    (line,) = err.splitlines()
    assert out == ""
    assert line.startswith(f"report: {path} ")
    assert problem in line
    remove = "delete it and " if path.exists() else ""
    assert line.endswith(f"; {remove}run: snakemake {path}")
    assert results.html.read_text() == "the old page"


def without(option, name):
    return lambda results: results.files[option].remove(name)


def only(option, name):
    return lambda results: results.files.update({option: [name]})


def with_record(name, old, new):
    return lambda results: swap(old, new)(results.folder / name)


SEEDS, CUBE = "trials/threshold_study/seeds.json", "trials/registration_study/cube_37.json"
ORBIT, OUTLIERS = "trials/beyond/orbit.json", "trials/threshold_study/outliers.json"
ONCE = "a parameter study needs trials that are registered once each, too"
MISFITS = [
    (without("figures", "figures/combined.png"), "the page needs the figure combined, too"),
    (without("figures", "figures/beyond.png"), "the page needs the figure beyond, too"),
    (without("thresholds", THRESHOLDS.format("pas")), "needs the table of pas_weight, too"),
    (without("replicates", "replicates/2.json"), "claims.csv was made for something else: line 2"),
    (only("replicates", "replicates/0.json"), "at least two replicate studies"),
    (without("threshold_parts", SEEDS), "threshold_study_time.csv has 45 rows, not 0; delete it"),
    (without("registration_parts", CUBE), "registration_study.csv was made for something else"),
    (only("threshold_parts", SEEDS), ONCE),
    (only("registration_parts", CUBE), ONCE),
    (without("scenarios", ORBIT), "beyond.csv has 242 rows, not 231; delete it"),
    (with_record(ORBIT, '"ATE", ', ""), "beyond.csv has 242 rows, not 241; delete it"),
    (with_record(OUTLIERS, '"TAS(quantile=0.9)", ', ""), "study_tas.csv has 15 rows, not 14; del"),
    (with_record(OUTLIERS, "quantile=0.9", "quantile=0.8"), "line 10 has the value 0.9, not 0.8"),
]


@pytest.mark.parametrize(("change", "problem"), MISFITS)
def test_files_that_do_not_fit_together_are_refused(results, capsys, change, problem):
    change(results)
    assert main(results.arguments()) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert problem in line
