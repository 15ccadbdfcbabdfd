"""The command line: files are told, and a page is written whole or not at all."""

import os
import runpy
import subprocess
import sys

import pytest

import report.crate
import report.explorer
import report.page
from report.__main__ import main


def test_the_folder_is_told(capsys):
    with pytest.raises(SystemExit) as ended:
        main([])
    assert ended.value.code == 2
    assert "required: --output" in capsys.readouterr().err


HELP = {  # of each program, without line breaks
    main: """\
usage: python -m report [-h] [--settings [key=value ...]] [--machine MACHINE] [--article]
--output HTML RESULTS
Write verdicts, figures and evidence on one self-contained page.
positional arguments: RESULTS the folder of all results
options: -h, --help show this help message and exit
--settings [key=value ...] what snakemake --config was given, but for how it was run
--machine MACHINE where it was run, in words
--article write the article instead
--output HTML
snakemake report makes all that the page needs, and the page
""",
    report.crate.main: """\
usage: python -m report.crate [-h] RESULTS
Describe a folder of results as an RO-Crate, for archives.
positional arguments: RESULTS the folder
options: -h, --help show this help message and exit
snakemake crate makes the report and the description of all results
""",
    report.explorer.main: """\
usage: python -m report.explorer [-h] --output HTML CAMERA_ERRORS.npz
Write the page that scores the errors of trials with any threshold.
positional arguments: CAMERA_ERRORS.npz errors of cameras
options: -h, --help show this help message and exit
--output HTML
snakemake explorer makes the errors, and the page
""",
}


@pytest.mark.parametrize("program", HELP, ids=lambda program: program.__module__)
def test_every_argument_is_explained(capsys, monkeypatch, program):
    monkeypatch.setenv("COLUMNS", "400")  # no word is divided
    with pytest.raises(SystemExit):
        program(["--help"])
    assert capsys.readouterr().out.split() == HELP[program].split()


def test_a_program_is_told_what_to_write(capsys):
    with pytest.raises(SystemExit) as ended:
        report.explorer.main(["errors.npz"])
    assert ended.value.code == 2
    assert "required: --output" in capsys.readouterr().err


def test_without_settings_the_results_are_to_be_those_of_the_whole_study(results, capsys):
    assert main([str(results.folder), "--output", str(results.html)]) == 1
    assert "was made with other settings" in capsys.readouterr().err


def test_the_page_is_named(results, capsys):
    results.html.unlink(missing_ok=True)
    assert main(results.arguments()) == 0
    assert capsys.readouterr() == (f"{results.html}\n", "")
    assert results.html.exists()


def test_the_old_page_stays_where_rendering_fails(results, monkeypatch):
    def fail(*_):
        raise RuntimeError("no more ink")

    results.html.write_text("the old page")
    before = sorted(results.folder.iterdir())
    monkeypatch.setattr(report.page, "render", fail)
    with pytest.raises(RuntimeError, match="no more ink"):
        main(results.arguments())
    assert results.html.read_text() == "the old page"
    assert sorted(results.folder.iterdir()) == before


def test_a_place_that_cannot_be_written_to_is_named(results, capsys):
    results.html.unlink(missing_ok=True)
    results.html.mkdir()
    assert main(results.arguments()) == 1
    message = f"report: cannot write {results.html}: Is a directory\n"
    assert capsys.readouterr().err == message


@pytest.mark.slow
def test_the_same_inputs_give_the_same_bytes_in_another_process(results):
    before = results.page().html
    results.html.unlink()
    subprocess.run(
        [sys.executable, "-m", "report", *results.arguments()],
        check=True,
        capture_output=True,
        env=os.environ | {"PYTHONHASHSEED": "7"},
    )
    assert results.html.read_text(encoding="utf-8") == before


@pytest.mark.parametrize("module", ["report.__main__", "report.crate", "report.explorer"])
def test_the_workflow_runs_modules(module, capsys, monkeypatch):
    monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.setattr(sys, "argv", ["", "--help"])
    with pytest.raises(SystemExit, match=r"^0$"):
        runpy.run_module(module, run_name="__main__")
    usage = capsys.readouterr().out
    assert usage.startswith(f"usage: python -m {module.removesuffix('.__main__')} ")
    assert ("[--settings [key=value ...]]" in usage) == (module == "report.__main__")
