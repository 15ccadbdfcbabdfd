"""Results made up in a moment, with every verdict in them, and a page read back."""

from collections.abc import Callable
from dataclasses import dataclass, field
from html.parser import HTMLParser
from io import BytesIO
from itertools import cycle, islice
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from experiments.config import experiment_names, load_sweep
from experiments.tables import write_trials
from report.__main__ import main
from studies.claims.claims import load_claims
from studies.paper.table1 import CRITERIA, PAPER, PROPERTIES, ROWS
from tests.figures.conftest import FIGURES

TRIALS = 7
VERDICTS = ("reproduced", "not reproduced", "reproduced", "inconclusive", "reproduced")


@dataclass(eq=False)
class Element:
    """An element of a page with all text in it."""

    tag: str
    attributes: dict[str, str | None]
    pieces: list[str] = field(default_factory=list)
    inner: list["Element"] = field(default_factory=list)

    @property
    def text(self) -> str:
        return " ".join("".join(self.pieces).split())

    def get(self, name: str) -> str:
        return self.attributes.get(name) or ""

    def all(self, *tags: str) -> list["Element"]:
        return [element for element in self.inner if element.tag in tags]


class Page(HTMLParser):
    """The elements of a page in their order."""

    VOID = ("meta", "img", "br")

    def __init__(self, html: str) -> None:
        super().__init__()
        self.html = html
        self.root = Element("", {})
        self.open = [self.root]
        self.feed(html)
        assert self.open == [self.root]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        element = Element(tag, dict(attrs))
        for outer in self.open:
            outer.inner.append(element)
        self.open += [element] if tag not in self.VOID else []

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop().tag == tag

    def handle_data(self, data: str) -> None:
        for element in self.open:
            element.pieces.append(data)

    def all(self, *tags: str) -> list[Element]:
        return self.root.all(*tags)

    def id(self, name: str) -> Element:
        (element,) = [element for element in self.root.inner if element.get("id") == name]
        return element


def write_results(folder: Path) -> None:
    """Write all that the page needs, and the tables of one study."""
    claims = list(load_claims().claims.values())
    verdicts = list(islice(cycle(VERDICTS), len(claims)))
    keys = ("id", "source", "figure", "sentence", "statement", "unit", "criterion", "paper")
    table = pd.DataFrame([{key: getattr(claim, key) for key in keys} for claim in claims])
    table = table.assign(
        statistic=[claim.describe() for claim in claims],
        implied_by=[" ".join(claim.implied_by) or None for claim in claims],
        replicates=20,
        **numbers(verdicts),
        pooled=0.5,
    )
    write(folder / "claims.csv", table)
    readings = pd.DataFrame(
        {"decision": "range", "question": "Which range?", "paper_says": "Silent.", "choice": "One."}
        | {"reading": "mean curve", "claim": table["id"][:2], "replicates": 3}
        | numbers(["inconclusive"] * 2)
    )
    write(folder / "tables/readings.csv", readings)
    criterion = {"word": "much less", "bound": 50, "other": 33, "claims": 9, "changed": 0}
    write(folder / "tables/criteria.csv", pd.DataFrame([criterion | {"changes": None}]))
    cells = [
        {"row": ROWS.get(metric, metric), "metric": metric, "property": name, "value": 0.25}
        | {"paper": "yes" if answer else "no", "ours": "yes", "agrees": "yes" if answer else "no"}
        | {"criterion": criterion}
        for metric, answers in PAPER.items()
        for name, criterion, answer in zip(PROPERTIES, CRITERIA, answers, strict=True)
    ]
    cells[-1] |= {"ours": "not tested", "agrees": None, "value": None}
    write(folder / "tables/method_comparison.csv", pd.DataFrame(cells))
    orders = {"experiment": ["outliers"] * 2, "metric": ["mAA", "TAS"], "order": [90.25, np.inf]}
    write(folder / "tables/head_to_head.csv", pd.DataFrame(orders))
    for name in FIGURES:
        Image.new("L", (990, 930), 255).save(buffer := BytesIO(), "PNG")
        (folder / "figures").mkdir(exist_ok=True)
        (folder / "figures" / f"{name}.png").write_bytes(buffer.getvalue())
    for name in experiment_names():
        sweep = load_sweep([f"experiment={name}", f"trials={TRIALS}"])
        write_trials(folder / "trials" / f"{name}.csv", pd.DataFrame(), (sweep,))


def numbers(verdicts: list[str]) -> dict[str, object]:
    """Return the numbers and words of claims with these verdicts."""
    truths = {"reproduced": "true", "not reproduced": "false", "inconclusive": "open"}
    columns = {"ours": 0.5, "low": 0.4, "high": 0.6, "mean_low": 0.45, "mean_high": 0.55}
    return columns | {"verdict": verdicts, "population": [truths[word] for word in verdicts]}


def write(path: Path, table: pd.DataFrame) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(path, index=False)


@pytest.fixture(scope="session")
def make_page() -> Callable[..., Page]:
    def make(folder: Path, *settings: str) -> Page:
        html = folder / "report.html"
        assert main([str(folder), "--output", str(html), "--settings", *settings]) == 0
        return Page(html.read_text("utf-8"))

    return make


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A folder of results, to be changed at will."""
    write_results(tmp_path / "results")
    return tmp_path / "results"


@pytest.fixture(scope="session")
def page(tmp_path_factory: pytest.TempPathFactory, make_page: Callable[..., Page]) -> Page:
    """The page of results in which nothing is changed."""
    folder = tmp_path_factory.mktemp("original")
    write_results(folder)
    return make_page(folder, "trials=7", "scenarios=/home/me/mine.yaml")
