"""The documents agree with the project and with each other; the data of their examples."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

import alignscores
from studies.claims import INCONCLUSIVE, NOT_REPRODUCED, REPRODUCED, statements

ROOT = Path(__file__).parents[2]
VERDICTS = REPRODUCED, NOT_REPRODUCED, INCONCLUSIVE
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
    """The package and its citation agree."""
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


def test_counts_of_statements_are_those_of_the_published_claims():
    """In README and on the page of the paper's claims."""
    claims = pd.read_csv(ROOT / "experiments" / "published" / "claims.csv")
    counted = claims[claims["implied_by"].isna()]
    of_claims = counted["verdict"].value_counts()
    of_statements = statements(claims)["verdict"].value_counts()
    reproduced, failed, unsure = (of_statements[verdict] for verdict in VERDICTS)
    words = dict(
        enumerate(
            ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten"]
        )
    )
    counts = (
        f"{reproduced} are reproduced, {words[failed]} are not, and {words[unsure]} are "
        "inconclusive"
    )
    readme = " ".join((ROOT / "README.md").read_text().split())
    assert f"{len(statements(claims))} checkable statements: {counts}" in readme
    findings = (ROOT / "docs" / "explanation" / "findings.md").read_text()
    assert (
        f"{len(statements(claims))} checkable statements **{reproduced} are reproduced**"
        in findings
    )
    assert f"| {', '.join(str(of_claims[verdict]) for verdict in VERDICTS)} |" in findings
