"""The code on the pages runs as it stands, and they name every protocol."""

import doctest
import re
from pathlib import Path

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


def test_the_table_has_every_name():
    page = (DOCS / "protocols.md").read_text()
    for family in PROTOCOLS:
        assert f"| `{family.syntax}` | {family.description}" in page
