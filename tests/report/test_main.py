"""The command line: files are told, and a page is written whole or not at all."""

import os
import runpy
import subprocess
import sys

import pytest

import report.page
from report.__main__ import main


def test_the_folder_is_told(capsys):
    with pytest.raises(SystemExit) as ended:
        main([])
    assert ended.value.code == 2
    assert "required: --output" in capsys.readouterr().err


def test_every_argument_is_explained(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    said = " ".join(capsys.readouterr().out.split())
    for words in (
        *("python -m report", "self-contained page", "snakemake report makes all", "RESULTS the"),
        *("key=value ...] what", "--machine MACHINE where", "--article write", "--output HTML"),
    ):
        assert words in said


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
