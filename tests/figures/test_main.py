import os
import subprocess
import sys

import pytest

from experiments.tables import write_trials
from figures import noise
from figures.__main__ import main

OUTLIERS = "figures.noise:outliers"


@pytest.fixture(scope="module")
def table(run, tmp_path_factory):
    """The table of experiment ``outliers``, small, with its record."""
    path = tmp_path_factory.mktemp("trials") / "outliers.csv"
    trials = run("outliers", "n_outliers=[0,10]", "sigma_t=[0.01,0.05]")
    write_trials(path, trials.table, trials.record.sweeps)
    return path


@pytest.mark.slow
def test_it_writes_both_files_the_same_bytes_in_another_process(table, tmp_path, capsys):
    written = [tmp_path / "figures" / f"one.{extension}" for extension in ("pdf", "png")]
    arguments = [OUTLIERS, str(table), "--output", *map(str, written)]
    assert main(arguments) == 0
    assert capsys.readouterr().out.splitlines() == [str(path) for path in written]
    assert sorted((tmp_path / "figures").iterdir()) == written
    before = [path.read_bytes() for path in written]
    assert all(noise.outliers.__doc__.encode() in content for content in before)  # their title
    code = (
        "import sys; from figures.__main__ import main\n"
        f"assert main({arguments!r}) == 0\n"
        "assert 'matplotlib.pyplot' not in sys.modules"  # no global state
    )
    subprocess.run(
        [sys.executable, "-c", code], check=True, env=os.environ | {"PYTHONHASHSEED": "7"}
    )
    assert [path.read_bytes() for path in written] == before


def refused(capsys, tmp_path, *arguments):
    """Return the one line that a command is refused with."""
    output = tmp_path / "figures" / "figure.pdf"
    assert main([*map(str, arguments), "--output", str(output)]) == 1
    out, err = capsys.readouterr()
    (line,) = err.splitlines()
    assert not out
    assert not output.parent.exists()
    return line.removeprefix("figures: ")


def test_what_draws_nothing_and_other_tables_are_refused(table, tmp_path, capsys):
    for name in ("nope", "figures.noise:nope", "figures.nope:draw"):
        assert refused(capsys, tmp_path, name) == f"{name} draws no figure"
    found = refused(capsys, tmp_path, OUTLIERS, table, table)
    assert found == f"{OUTLIERS} is not drawn from 2 tables"


def test_a_table_at_fault_is_named_in_one_line_with_the_remedy(table, tmp_path, capsys):
    lost = tmp_path / "tables" / "no.csv"
    for draw in (OUTLIERS, "studies.beyond.figure:draw"):
        found = refused(capsys, tmp_path, draw, lost)
        assert found == f"{lost} does not exist; run: snakemake {lost}"
    damaged = tmp_path / "outliers.csv"
    damaged.with_suffix(".json").write_bytes(table.with_suffix(".json").read_bytes())
    damaged.write_text(table.read_text().replace(",DTE,", ",XTE,"))
    found = refused(capsys, tmp_path, OUTLIERS, damaged)
    problem = "was changed, or outliers.json is not its record"
    assert found == f"{damaged} {problem}; delete it and run: snakemake {damaged}"
