"""The code on the pages runs as it stands, and they name every protocol."""

import doctest
import json
import re
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import matplotlib
import pytest

from alignscores.protocols import PROTOCOLS

DOCS = Path(__file__).parents[1] / "docs"


@pytest.mark.parametrize("page", ["protocols", "protocol-surprises"])
def test_examples_on_pages(page):
    """All blocks of a page, one after the other."""
    text = (DOCS / f"{page}.md").read_text()
    code = "\n".join(re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL))
    test = doctest.DocTestParser().get_doctest(code, {}, page, None, None)
    assert len(test.examples) > 5
    failures: list[str] = []
    doctest.DocTestRunner().run(test, out=failures.append)
    assert not failures, "".join(failures)


def run(code: str, names: dict[str, Any]) -> str:
    """Run code and return what it prints."""
    printed = StringIO()
    with redirect_stdout(printed):
        exec(code, names)
    return printed.getvalue()


def test_half_score_distances_of_known_errors_are_those_of_the_page():
    page = (DOCS / "profiles.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    for name, *numbers in map(str.split, run(code, {}).splitlines()):
        (row,) = re.findall(rf"^\| {name}.*$", page, flags=re.MULTILINE)
        assert [cell.strip() for cell in row.split("|")[2:-1]] == numbers


def test_the_notebook_prints_what_it_shows():
    cells = json.loads((DOCS / "notebooks" / "own_poses.ipynb").read_text())["cells"]
    names: dict[str, Any] = {}
    shown = 0
    with matplotlib.rc_context({"backend": "agg"}):
        for cell in cells:
            if cell["cell_type"] != "code":
                continue
            texts = ["".join(o["text"]) for o in cell["outputs"] if o["output_type"] == "stream"]
            code = "".join(cell["source"]).replace("plt.show()", "plt.close()")
            assert run(code, names) == "".join(texts)
            shown += bool(texts)
    assert shown == 2


def test_the_table_has_every_name():
    page = (DOCS / "protocols.md").read_text()
    for family in PROTOCOLS:
        assert f"| `{family.syntax}` | {family.description}" in page
