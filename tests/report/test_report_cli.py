"""A wrong command or a file at fault ends in one line, and the old page stays."""

from collections.abc import Callable
from pathlib import Path

import pytest

import report.__main__
from report.__main__ import main

Change = Callable[[Path], object]


def put(name: str, content: str) -> Change:
    return lambda results: (results / name).write_text(content)


def lose(name: str) -> Change:
    return lambda results: (results / name).unlink()


def cut(name: str) -> Change:
    return lambda results: (results / name).write_bytes((results / name).read_bytes()[:60])


def swap(name: str, old: str, new: str) -> Change:
    def change(results: Path) -> None:
        text = (results / name).read_text()
        assert old in text
        (results / name).write_text(text.replace(old, new, 1))

    return change


THRESHOLDS, REGISTRATIONS = "experiments.threshold_study", "experiments.registration_study"
TIMES, FINDINGS = "experiments.study_time {}", "experiments.findings"
VERDICTS, TABLE_1 = "experiments.verdicts", "experiments.comparison"
TRIALS = "experiments.run experiment=rotations"
REPLICATE = "experiments.replicate ... replicate={}"
FAULTS = [
    ("claims.csv", lose, (), "does not exist", VERDICTS),
    ("claims.csv", put, ("",), "cannot be read (No columns", VERDICTS),
    ("claims.csv", put, ("a,b\n1,2\n",), "has no column id", VERDICTS),
    ("claims.csv", swap, (",-74.0,", ",-75.0,"), "was made for something else", VERDICTS),
    ("claims.csv", swap, (",reproduced", ",true"), "has an unknown verdict 'true'", VERDICTS),
    ("claims.csv", swap, (",0.3,", ",x,"), "has values of ours that are no numbers", VERDICTS),
    ("tables/decisions.csv", lose, (), "does not exist", VERDICTS),
    ("tables/decisions.csv", swap, ("mean curve", "median"), "line 18 is not", VERDICTS),
    ("tables/method_comparison.csv", lose, (), "does not exist", TABLE_1),
    ("tables/method_comparison.csv", swap, ("TAS", "XAS"), "was made for something", TABLE_1),
    ("figures/combined.png", lose, (), "does not exist", "figures combined"),
    ("figures/combined.png", put, ("GIF89a",), "is no PNG", "figures combined"),
    ("figures/combined.png", cut, (), "is no PNG", "figures combined"),
    ("figures/threshold_study.png", lose, (), "does not exist", "figures threshold_study"),
    ("figures/paths.png", lose, (), "does not exist", "figures.beyond"),
    ("tables/threshold_study_ras.csv", lose, (), "does not exist", THRESHOLDS),
    ("tables/threshold_study_tas.csv", swap, (",yes,", ",no,"), "line 4 is not", THRESHOLDS),
    ("tables/threshold_study_pas.csv", swap, ("0.25", "0.3"), "line 3 is not", THRESHOLDS),
    ("tables/threshold_study_time.csv", lose, (), "does not exist", TIMES.format("threshold")),
    (
        "tables/registration_study_time.csv",
        swap,
        ("1.25", "x"),
        "has values of milliseconds that are no numbers",
        TIMES.format("registration"),
    ),
    ("tables/registration_study.csv", put, ("part\n",), "has no column", REGISTRATIONS),
    ("tables/registration_study.csv", swap, ("line_37", "line_38"), "line", REGISTRATIONS),
    ("tables/beyond.csv", lose, (), "does not exist", FINDINGS),
    ("tables/beyond.csv", swap, ("orbit,RAS", "orbit,SAR"), "is not orbit/RAS", FINDINGS),
    (
        "trials/threshold_study/length.json",
        lose,
        (),
        "does not exist",
        "experiments.study threshold length",
    ),
    ("trials/beyond/bias.json", put, ("{",), "is no record", "experiments.scenarios bias"),
    ("trials/rotations.json", lose, (), "does not exist", TRIALS),
    ("replicates/1.json", put, ("{",), "is no record of provenance", REPLICATE.format(1)),
    (
        "replicates/2.json",
        swap,
        ('"trials": 50', '"trials": 5'),
        "has other settings than replicate 0",
        REPLICATE.format(2),
    ),
]


@pytest.mark.parametrize(("name", "how", "arguments", "problem", "module"), FAULTS)
def test_a_file_at_fault_is_named_with_the_remedy(
    results: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
    how: Callable[..., Change],
    arguments: tuple[str, ...],
    problem: str,
    module: str,
) -> None:
    (results / "report.html").write_text("the old page")
    how(name, *arguments)(results)
    assert main([f"results_dir={results}"]) == 1
    out, err = capsys.readouterr()
    (line,) = err.splitlines()
    assert out == ""
    assert line.startswith(f"report: {results / name} ")
    assert problem in line
    module, _, after = module.partition(" ...")
    assert line.endswith(f"; run: python -m {module} results_dir={results}{after}")
    assert (results / "report.html").read_text() == "the old page"


def test_another_number_of_replicates_is_refused_and_passed_on(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([f"results_dir={results}", "replicates=3", "trials=50"]) == 0
    capsys.readouterr()
    assert main(["replicates=4", f"results_dir={results}"]) == 1
    assert capsys.readouterr().err == (
        f"report: {results / 'claims.csv'} rests on 3 replicates, not 4; "
        f"run: python -m experiments.verdicts replicates=4 results_dir={results}\n"
    )


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ("colour=red", "unknown setting 'colour'"),
        ("trials", "'trials' is not a setting"),
        ("replicates=1", "setting 'replicates' must be a whole number of at least 2"),
        ("replicates=x", "setting 'replicates' must be a whole number, not 'x'"),
        ("tas_quantile=2", "setting 'tas_quantile' must be a list in brackets"),
    ],
)
def test_a_wrong_setting_is_refused_in_one_line(
    capsys: pytest.CaptureFixture[str], argument: str, message: str
) -> None:
    assert main([argument]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"report: {message}")
    assert len(err.splitlines()) == 1


def test_the_old_page_stays_where_rendering_fails(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: object) -> str:
        raise RuntimeError("no more ink")

    (results / "report.html").write_text("the old page")
    before = sorted(results.iterdir())
    monkeypatch.setattr(report.__main__, "render", fail)
    with pytest.raises(RuntimeError, match="no more ink"):
        main([f"results_dir={results}"])
    assert (results / "report.html").read_text() == "the old page"
    assert sorted(results.iterdir()) == before


def test_a_place_that_cannot_be_written_to_is_named(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (results / "report.html").mkdir()
    assert main([f"results_dir={results}"]) == 1
    message = f"report: cannot write {results / 'report.html'}: Is a directory\n"
    assert capsys.readouterr().err == message
