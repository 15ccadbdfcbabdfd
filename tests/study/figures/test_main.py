import os
import subprocess
import sys

import pandas as pd
import pytest

from experiments.tables import write_trials
from figures import paper
from figures.__main__ import main


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
    arguments = ["outliers", str(table), "--output", *map(str, written)]
    assert main(arguments) == 0
    assert capsys.readouterr().out.splitlines() == [str(path) for path in written]
    assert sorted((tmp_path / "figures").iterdir()) == written
    before = [path.read_bytes() for path in written]
    title = paper.outliers.__doc__.partition("\n")[0].encode()
    assert all(title in content for content in before)
    code = (
        "import sys; from figures.__main__ import main\n"
        f"assert main({arguments!r}) == 0\n"
        "assert 'matplotlib.pyplot' not in sys.modules"  # no global state
    )
    subprocess.run(
        [sys.executable, "-c", code], check=True, env=os.environ | {"PYTHONHASHSEED": "7"}
    )
    assert [path.read_bytes() for path in written] == before


def test_all_figures_of_the_paper_are_drawn_from_a_folder(run, tmp_path, capsys):
    trials, figures = tmp_path / "trials", tmp_path / "figures"
    for experiment in {name for _, names in paper.FIGURES.values() for name in names}:
        result = run(experiment)
        write_trials(trials / f"{experiment}.csv", result.table, result.record.sweeps)
    assert main(["paper", str(trials), "--output", str(figures)]) == 0
    expected = {figures / f"{name}.{end}" for name in paper.FIGURES for end in ("pdf", "png")}
    assert set(figures.iterdir()) == expected
    path = tmp_path / "combined.png"
    assert main(["combined", str(trials / "combined.csv"), "--output", str(path)]) == 0
    assert path.read_bytes() == (figures / "combined.png").read_bytes()
    capsys.readouterr()


def test_any_table_is_drawn_next_to_it_and_nothing_is_replaced(table, tmp_path, capsys):
    copied = tmp_path / "own.csv"
    pd.read_csv(table).query("n_outliers == 10").assign(mine=1.0).to_csv(copied)  # with an index
    assert main([str(copied)]) == 0
    assert capsys.readouterr().out.splitlines() == [str(tmp_path / "own.png")]
    before = copied.read_bytes(), (tmp_path / "own.png").read_bytes()
    assert main([str(copied)]) == 1
    assert "own.png exists, and is not replaced; name a file" in capsys.readouterr().err
    assert (copied.read_bytes(), (tmp_path / "own.png").read_bytes()) == before
    path = tmp_path / "other.pdf"
    assert main([str(copied), "--output", str(path)]) == 0
    assert path.exists()
    capsys.readouterr()


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
    for name in ("figures.paper:nope", "figures.nope:draw"):
        assert refused(capsys, tmp_path, name, table) == f"{name} draws no figure"
    message = refused(capsys, tmp_path, "outliers", table, table)
    assert message == "outliers is not drawn from 2 tables"
    assert refused(capsys, tmp_path, "nope", table).startswith("unknown figure nope; the paper's")
    message = refused(capsys, tmp_path, "outlier", table)
    assert message == "unknown figure outlier; did you mean outliers?"
    assert refused(capsys, tmp_path, "outlier") == message
    message = refused(capsys, tmp_path, "collinear", table)
    assert message == f"collinear is drawn from trials of collinear; {table} has trials of outliers"


def test_a_table_at_fault_is_named_in_one_line_and_stays(table, tmp_path, capsys):
    lost = tmp_path / "no.csv"
    for draw in (["outliers"], ["studies.beyond:draw"], []):
        assert refused(capsys, tmp_path, *draw, lost).startswith(f"{lost} does not exist")
    changed = tmp_path / "changed.csv"
    changed.write_bytes(table.read_bytes() + b"\n")
    changed.with_suffix(".json").write_bytes(table.with_suffix(".json").read_bytes())
    message = refused(capsys, tmp_path, "outliers", changed)
    assert message.startswith(f"{changed} was changed, or changed.json is not its record")
    other = tmp_path / "other.csv"
    other.write_text("a,b\n1,2\n3,4,5\n")
    assert refused(capsys, tmp_path, other).startswith(f"{other} cannot be read (")
    assert other.exists()
    assert main([str(table), "--output", str(table)]) == 1
    assert "a figure is a .pdf or a .png" in capsys.readouterr().err
    assert table.exists()
