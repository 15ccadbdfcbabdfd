"""The command line: files are named, and a page is written whole or not at all."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from report.__main__ import main

ROOT = Path(__file__).resolve().parents[2]


def test_settings_other_than_those_of_the_results_are_refused(results, capsys):
    assert main([str(results.folder), "--output", str(results.html)]) == 1
    assert "was made with other settings" in capsys.readouterr().err


def test_the_page_is_named(results, capsys):
    results.html.unlink(missing_ok=True)
    assert main(results.arguments()) == 0
    assert capsys.readouterr() == (f"{results.html}\n", "")
    assert results.html.exists()


def test_the_old_page_stays_where_a_table_is_missing(results, capsys):
    results.html.write_text("the old page")
    (results.folder / "claims.csv").unlink()
    assert main(results.arguments()) == 1
    assert "claims.csv does not exist; run: snakemake" in capsys.readouterr().err
    assert results.html.read_text() == "the old page"


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
        cwd=ROOT,
        env=os.environ | {"PYTHONHASHSEED": "7"},
    )
    assert results.html.read_text(encoding="utf-8") == before
