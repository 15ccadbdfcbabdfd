"""What the documents say of the project and of each other."""

import json
import re
import tomllib
from pathlib import Path

import pytest
import yaml

import alignscores

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob(".github/*.md")])
LINK = re.compile(r"(?:\]\(|src=\")(?!https?:|#)([^)#\"\s]+)")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_files(document):
    links = LINK.findall(document.read_text(encoding="utf-8"))
    assert [link for link in links if not (document.parent / link).exists()] == []


def test_links_are_found():
    assert LINK.findall((ROOT / "README.md").read_text(encoding="utf-8")).count("CITATION.cff") == 1


def test_one_version_and_one_licence():
    """Of the package, for who cites it and for the archive."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    archive = json.loads((ROOT / ".zenodo.json").read_text())
    assert {one["version"] for one in (citation, archive)} == {alignscores.__version__}
    assert {one["license"] for one in (project, citation, archive)} == {"BSD-3-Clause"}
    assert (ROOT / "LICENSE").read_text().startswith("BSD 3-Clause License")
    assert archive["keywords"] == citation["keywords"]
