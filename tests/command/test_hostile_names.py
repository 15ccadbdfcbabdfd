"""Names of files that hold terminal escapes, formulas and ends of lines."""

import csv
import io
import shutil

import pandas as pd
import pytest

SYSTEMS = {  # names of folders, and how they are written to CSV
    "=1+cmd": "'=1+cmd",
    "+1": "'+1",
    "-1": "'-1",
    "@SUM(A1)": "'@SUM(A1)",
    "a\rb": "a\\rb",
    "\t=1": "\\t=1",
    "\x1b[2Jx": "\\x1b[2Jx",
    "\x9b2J": "\\x9b2J",
    'a=b, "c"': 'a=b, "c"',
    "<script>'$x^2$ & 5%": "<script>'$x^2$ & 5%",
    "grün": "grün",
}


def is_plain(text):
    return text.replace("\n", "").isprintable()


@pytest.fixture
def hostile(run_compare, examples, tmp_path):
    """Patterns of a comparison in which everything has such a name."""
    for system in SYSTEMS:
        folder = tmp_path / "s\x1b]0;t\x07" / system
        folder.mkdir(parents=True)
        shutil.copy(examples / "tum/estimate.txt", folder / "1\x1b[1m.txt")
    (folder / "1\x1b[1m.txt").write_text("\x1b[2J")  # cannot be read
    shutil.copy(examples / "tum/reference.txt", folder.parent / "gt.txt")
    return "tum", "{sequence}/gt.txt", "{sequence}/{system}/{run}.txt"


def test_no_escape_reaches_the_terminal(run_compare, hostile):
    printed = {}
    for show in ("", "--csv", "--json", "--markdown -", "--latex"):
        code, out, err = run_compare(*hostile, "--jobs", 1, "--cache", "cache", *show.split())
        assert code == 1, show  # of the file that cannot be read
        assert is_plain(out), show
        assert is_plain(err), show
        printed[show] = out
    assert "<script" not in printed["--markdown -"].replace("\\<", "")
    table = printed["--latex"].partition(r"\bottomrule")[0]
    assert r"\textless{}script\textgreater{}'\$x\textasciicircum{}2\$ \& 5\%" in table


def test_a_spreadsheet_and_pandas_read_the_names(run_compare, hostile):
    out = run_compare(*hostile, "--jobs", 1, "--csv")[1]
    rows = list(csv.DictReader(io.StringIO(out)))
    table = pd.read_csv(io.StringIO(out))
    for names in ({row["system"] for row in rows}, set(table["system"])):
        assert names == set(SYSTEMS.values())
    assert table["TAS"].dtype == float
