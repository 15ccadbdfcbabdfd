import os
import subprocess
import sys
from contextlib import redirect_stdout
from io import StringIO

import matplotlib.figure
import pandas as pd
import pytest
from matplotlib.image import imread

from experiments.config import load
from experiments.tables import provenance, write_table
from figures import FIGURES
from figures.__main__ import main


def run(capsys, *arguments):
    code = main(arguments)
    out, err = capsys.readouterr()
    return code, out.splitlines(), err.splitlines()


def files(directory):
    return sorted(str(path.relative_to(directory)) for path in directory.rglob("figures/*"))


@pytest.fixture(scope="module")
def outliers(tmp_path_factory, write_tables):
    """The figure ``outliers`` as it is written by the command line."""
    directory = tmp_path_factory.mktemp("results")
    arguments = ["outliers", write_tables(directory, "outliers")]
    with redirect_stdout(StringIO()) as out:
        assert main(arguments) == 0
    return arguments, directory / "figures", out.getvalue().splitlines()


def test_it_writes_both_files_and_says_where(outliers):
    _, directory, out = outliers
    assert out == [str(directory / "outliers.pdf"), str(directory / "outliers.png")]
    assert sorted(map(str, directory.iterdir())) == out
    assert imread(directory / "outliers.png").shape[1] == 990  # 3.3 inches, 300 dpi


def test_fonts_are_embedded_as_truetype_and_there_is_no_date(outliers):
    _, directory, _ = outliers
    pdf = (directory / "outliers.pdf").read_bytes()
    assert b"/FontFile2" in pdf  # a TrueType font, embedded
    assert b"/CIDFontType2" in pdf
    assert b"/Type3" not in pdf
    assert b"CreationDate" not in pdf
    assert b"Figure 2: translation metrics" in pdf
    png = (directory / "outliers.png").read_bytes()
    assert b"Software" not in png
    assert b"Figure 2: translation metrics" in png


def test_the_same_table_gives_the_same_bytes_in_another_process(outliers):
    arguments, directory, _ = outliers
    before = {path.name: path.read_bytes() for path in directory.iterdir()}
    code = (
        "import sys; from figures.__main__ import main\n"
        f"assert main({arguments!r}) == 0\n"
        "assert 'matplotlib.pyplot' not in sys.modules"  # no global state
    )
    subprocess.run(
        [sys.executable, "-c", code], check=True, env=os.environ | {"PYTHONHASHSEED": "7"}
    )
    assert {path.name: path.read_bytes() for path in directory.iterdir()} == before


def test_settings_are_those_of_the_experiments(tmp_path, capsys):
    pictures = []
    for seed in ("seed=3", "seed=4"):
        code, _, _ = run(capsys, "histogram", f"results_dir={tmp_path}", seed, "sigma_t=[0.05]")
        assert code == 0
        pictures.append((tmp_path / "figures" / "histogram.png").read_bytes())
    assert pictures[0] != pictures[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nope"], "unknown figure 'nope'; the figures are histogram, outliers"),
        (["outliers", "trials"], "'trials' is not a setting"),
        (["outliers", "colour=red"], "unknown setting 'colour'"),
        (["outliers", "experiment=collinear"], "'experiment' is given twice"),
    ],
)
def test_a_wrong_command_is_refused_in_one_line(capsys, arguments, message):
    code, out, err = run(capsys, *arguments)
    assert (code, out, len(err)) == (2, [], 1)
    assert err[0].startswith("figures: ")
    assert message in err[0]


HEAD = "experiment,geometry,n_cameras,n_outliers,sigma_t,sigma_r_deg,replicate,trial"
ROW = "collinear,line,100,0,0.01,3.0,0,0"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "does not exist"),
        ("", "cannot be read"),
        ("a,b\n1,2\n", "has no column experiment"),
        (f"{HEAD},ATE\n", "has no trials"),
        (f"{HEAD},ATE\n{ROW.replace('collinear', 'outliers')},1\n", "of experiment 'outliers'"),
        (f"{HEAD},ATE\n{ROW},0.5\n", "has no column DTE"),
        (f"{HEAD},ATE,DTE,mAA,TAS\n{ROW},0.5,0.5\n", "values of mAA that are no finite numbers"),
    ],
)
def test_a_table_at_fault_is_named_in_one_line_with_the_remedy(tmp_path, capsys, content, message):
    path = tmp_path / "trials" / "collinear.csv"
    if content is not None:
        record = provenance(load(["experiment=collinear"]))
        write_table(path, pd.DataFrame(), record)
        path.write_text(content)
    code, out, err = run(capsys, "collinear", f"results_dir={tmp_path}")
    assert (code, out, len(err)) == (1, [], 1)
    assert err[0].startswith(f"figures: {path} ")
    assert message in err[0]
    assert "; run: python -m experiments.run experiment=collinear results_dir=" in err[0]
    assert files(tmp_path) == []


def test_the_remedy_names_the_table_at_fault_and_replaces_the_setting(
    write_tables, tmp_path, capsys
):
    arguments = write_tables(tmp_path, *FIGURES["maa_vs_pas"])
    path = tmp_path / "trials" / "maa_vs_pas_length.csv"
    path.write_text(path.read_text().replace(",PAS", ",XAS"))
    code, _, err = run(capsys, "maa_vs_pas", arguments, "metrics=[mAA]")
    assert code == 1
    assert err == [
        f"figures: {path} has no column PAS; set metrics=[mAA,PAS] here, too; "
        "run: python -m experiments.run experiment=maa_vs_pas_length "
        f"results_dir={tmp_path} 'metrics=[mAA,PAS]'"
    ]


def test_nothing_is_left_where_drawing_fails(tmp_path, monkeypatch):
    save = matplotlib.figure.Figure.savefig

    def fail(self, *args, format, **kwargs):
        if format == "png":
            raise RuntimeError("no more ink")
        save(self, *args, format=format, **kwargs)

    monkeypatch.setattr(matplotlib.figure.Figure, "savefig", fail)
    with pytest.raises(RuntimeError, match="no more ink"):
        main(["histogram", f"results_dir={tmp_path}"])
    assert files(tmp_path) == []


def test_a_place_that_cannot_be_written_to_is_named(tmp_path, capsys):
    (tmp_path / "figures").write_text("a file, not a directory")
    code, out, err = run(capsys, "histogram", f"results_dir={tmp_path}")
    assert (code, out) == (1, [])
    assert err == [f"figures: cannot write {tmp_path / 'figures' / 'histogram.pdf'}: File exists"]


def test_help_lists_the_figures(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    assert "maa_vs_pas" in capsys.readouterr().out
