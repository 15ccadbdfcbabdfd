"""Tables of evaluations: their names are inert, and their notes are all there."""

import dataclasses
import io
import re

import pandas as pd
import pytest

from alignscores import evaluate
from alignscores.show import tables
from tests.files import AT_STAMPS, FILES, TUM

HOSTILE = ["=1+1", "a|b`c`<i>", "50%_of $x$ & #1 {~^\\}", "x\n\x1b[31m\r"]


@pytest.fixture
def named(examples):
    evaluation = evaluate(*(examples / name for name in FILES["tum"]))
    return [dataclasses.replace(evaluation, name=name) for name in HOSTILE]


def test_names_are_inert_everywhere(named):
    for text in (
        tables.text(named, 200),
        "\n".join(map(" ".join, tables.deficits_of(named))),
        tables.markdown(named),
        tables.latex(named),
        tables.csv(named),
    ):
        assert text.replace("\n", "").isprintable()
    assert pd.read_csv(io.StringIO(tables.csv(named)))["name"].tolist() == [
        "'=1+1",
        *HOSTILE[1:3],
        r"x\n\x1b[31m\r",
    ]
    markdown = tables.markdown(named)
    assert r"a\|b\`c\`\<i\>" in markdown
    assert len({len(re.findall(r"(?<!\\)\|", line)) for line in markdown.splitlines()[:6]}) == 1
    latex = tables.latex(named)
    assert r"50\%\_of \$x\$ \& \#1 \{" in latex
    head, rows, notes = latex.replace(r"\bottomrule", r"\midrule").split(r"\midrule")
    assert rows.count(r"\\") == len(named)
    assert r"\toprule" in head
    assert notes.splitlines()[1].startswith(
        r"\multicolumn{10}{l}{\footnotesize alignment: similarity (refined); 40 frames at"
    )
    assert " d = 0.606 m; half: " in " ".join(re.findall(r"footnotesize (.*)}", notes))


def test_markdown_has_the_table_the_conditions_and_all_notes(run, tmp_path):
    path = tmp_path / "scores.md"
    code, out, err = run(*TUM, *AT_STAMPS, "--t_offset", "auto", "-v", "--markdown", path)
    assert code == 0
    written = path.read_text().replace("\\", "")
    row = out.splitlines()[1].split()
    assert all(f" {cell} |" in written for cell in row)
    assert out.splitlines()[2] in written
    notes = [line.removeprefix("alignscores: note: ") for line in err.splitlines()]
    assert notes
    assert all(f"- {note}" in written for note in notes)
    assert run(*TUM, *AT_STAMPS, "--t_offset", "auto", "--markdown", "-")[1] == path.read_text()
