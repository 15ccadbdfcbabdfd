"""What the documents say of the project and of each other, and the data of their examples."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import yaml

import alignscores

ROOT = Path(__file__).parents[1]
FOLDERS = ("*.md", "docs/[!_]*.md", "docs/[!_]*/*.md", ".github/*.md")
DOCUMENTS = sorted(path for pattern in FOLDERS for path in ROOT.glob(pattern))
LINK = re.compile(r"(?:\]\(|src=\")([^)\"\s]+)")
ADDRESS = re.compile(r"https://[\w.-]+(/[\w./%-]*)?(#[\w-]+)?")


def text_of(document):
    """A document without its code."""
    return re.sub(r"^```.*?^```", "", document.read_text(encoding="utf-8"), flags=re.M | re.DOTALL)


def anchors(document):
    """The names of the headings of a document, as GitHub and MyST make them."""
    headings = re.findall(r"^#+ (.*)$", text_of(document), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(document):
    """To files, and headings in these; other sites are not asked."""
    for link in LINK.findall(text_of(document)):
        if ":" in link:
            assert ADDRESS.fullmatch(link), link
            continue
        path, _, anchor = link.partition("#")
        target = document.parent / path if path else document
        assert target.is_file(), link
        assert not anchor or anchor in anchors(target), link


def test_one_version_and_one_licence():
    """Of the package, and for who cites it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == alignscores.__version__
    assert project["license"] == citation["license"] == "BSD-3-Clause"
    assert (ROOT / "LICENSE").read_text().startswith("BSD 3-Clause License")


def test_the_flight_is_what_its_script_writes(tmp_path):
    """Every number of the documentation can be computed again from a clone."""
    flight = ROOT / "tests" / "data" / "flight"
    subprocess.run([sys.executable, flight / "make.py", tmp_path], check=True)
    written = sorted(path.name for path in tmp_path.iterdir())
    assert written == sorted(path.name for path in flight.glob("*.txt"))
    for name in written:
        rows = np.loadtxt(flight / name)
        np.testing.assert_allclose(np.loadtxt(tmp_path / name), rows, rtol=0, atol=2e-3)
