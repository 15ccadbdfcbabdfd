import os
import subprocess
import sys

import pytest
from matplotlib.figure import Figure

from experiments.tables import write_trials
from figures import FIGURES, beyond, outliers
from figures.__main__ import main


@pytest.fixture(scope="module")
def table(run, tmp_path_factory):
    """The table of experiment ``outliers``, small, with its record."""
    path = tmp_path_factory.mktemp("trials") / "outliers.csv"
    trials = run("outliers", "n_outliers=[0,10]", "sigma_t=[0.01,0.05]")
    write_trials(path, trials.table, trials.record.sweeps)
    return path


def test_it_writes_both_files_the_same_bytes_in_another_process(table, tmp_path, capsys):
    arguments = ["outliers", str(table), "--output", str(tmp_path / "figures" / "one")]
    assert main(arguments) == 0
    written = [tmp_path / "figures" / f"one.{extension}" for extension in ("pdf", "png")]
    assert capsys.readouterr().out.splitlines() == [str(path) for path in written]
    assert sorted((tmp_path / "figures").iterdir()) == written
    before = [path.read_bytes() for path in written]
    assert all(outliers.__doc__.encode() in content for content in before)  # their title
    code = (
        "import sys; from figures.__main__ import main\n"
        f"assert main({arguments!r}) == 0\n"
        "assert 'matplotlib.pyplot' not in sys.modules"  # no global state
    )
    subprocess.run(
        [sys.executable, "-c", code], check=True, env=os.environ | {"PYTHONHASHSEED": "7"}
    )
    assert [path.read_bytes() for path in written] == before


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["nope", "--output", "figure"], 2, "invalid choice: 'nope' (choose from"),
        (["paths"], 2, "required: --output"),
        (["--help"], 0, "| maa_vs_pas |"),
    ],
)
def test_a_wrong_command_is_refused_and_help_lists_the_figures(capsys, arguments, code, message):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == code
    assert message in " ".join("".join(capsys.readouterr()).split())


def refused(capsys, tmp_path, *arguments):
    """Return the one line that a command is refused with."""
    output = tmp_path / "figures" / "figure"
    assert main([*map(str, arguments), "--output", str(output)]) == 1
    out, err = capsys.readouterr()
    (line,) = err.splitlines()
    assert not out
    assert not output.parent.exists()
    return line.removeprefix("figures: ")


def test_tables_that_are_not_those_of_the_figure_are_refused(table, tmp_path, capsys):
    found = refused(capsys, tmp_path, "outliers", table, table)
    assert found == "outliers is drawn from trials/outliers.csv; the command names 2"
    found = refused(capsys, tmp_path, "paths", table)
    assert found == "paths is drawn from no table; the command names 1"
    found = refused(capsys, tmp_path, "collinear", table)
    assert found == f"collinear: {table} has trials of outliers, not of collinear"


def test_a_table_at_fault_is_named_in_one_line_with_the_remedy(table, tmp_path, capsys):
    for name, file in (("outliers", tmp_path / "no.json"), ("beyond", tmp_path / "no.csv")):
        found = refused(capsys, tmp_path, name, tmp_path / "no.csv")
        assert found == f"{file} does not exist; run: snakemake {file}"
    damaged = tmp_path / "outliers.csv"
    damaged.with_suffix(".json").write_bytes(table.with_suffix(".json").read_bytes())
    damaged.write_text(table.read_text().replace(",DTE,", ",XTE,"))
    remedy = f"delete it and run: snakemake {damaged}"
    found = refused(capsys, tmp_path, "outliers", damaged)
    assert found == f"{damaged} has no column DTE; {remedy}"
    found = refused(capsys, tmp_path, "beyond", damaged)
    assert found == f"{damaged} has no column {beyond.COLUMNS[0]}; {remedy}"


def test_tables_of_a_study_are_joined_and_values_of_axes_are_text(tmp_path, monkeypatch):
    from figures import threshold_study

    columns = list(threshold_study.COLUMNS)
    tables = [tmp_path / f"{i}.csv" for i in range(len(FIGURES["threshold_study"]))]
    for i, path in enumerate(tables):
        row = {"axis": f"axis {i}", "value": "1"}
        path.write_text(f"{','.join(columns)}\n{','.join(row.get(c, '0') for c in columns)}\n")
    drawn = []
    monkeypatch.setattr(threshold_study, "draw", lambda table: drawn.append(table) or Figure())
    assert main(["threshold_study", *map(str, tables), "--output", str(tmp_path / "one")]) == 0
    (table,) = drawn
    assert table["axis"].tolist() == [f"axis {i}" for i in range(len(tables))]
    assert table["value"].tolist() == ["1"] * len(tables)
    assert table.index.is_unique


def test_a_place_that_cannot_be_written_to_is_named(tmp_path, capsys):
    (tmp_path / "file").write_text("no directory")
    assert main(["paths", "--output", str(tmp_path / "file" / "paths")]) == 1
    problem = f"figures: cannot write {tmp_path / 'file' / 'paths.pdf'}: File exists\n"
    assert capsys.readouterr() == ("", problem)
