"""A file at fault ends in one line that names it with the remedy, and the old page stays."""

import pytest

from report.__main__ import main


@pytest.mark.parametrize(
    ("name", "old", "new", "problem"),
    [
        ("claims.csv", "outliers-range-maa,", "outliers-range-mab,", "was made for other claims"),
        ("tables/readings.csv", "taken,", "token,", "was made for other claims"),
        ("tables/head_to_head.csv", None, None, "does not exist"),
        ("figures/combined.png", None, "GIF89a", "is not a PNG"),
        ("trials/beyond/bias.json", None, "{", "is not the record of a table of trials"),
        ("trials/beyond/bias.csv", None, "1", "was changed, or bias.json is not its record"),
    ],
)
def test_a_file_at_fault_is_named_with_the_remedy(results, capsys, name, old, new, problem):
    results.html.write_text("the old page")
    path = results.folder / name
    if new is None:
        path.unlink()
    else:
        path.write_text(path.read_text().replace(old, new, 1) if old else new)
    assert main(results.arguments()) == 1
    out, err = capsys.readouterr()
    remove = "delete it and " if path.exists() else ""
    assert (out, err) == ("", f"report: {path} {problem}; {remove}run: snakemake {path}\n")
    assert results.html.read_text() == "the old page"
