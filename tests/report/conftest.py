"""A results folder made up in a moment, with every verdict in it, and a page read back."""

import json
import shutil
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from html.parser import HTMLParser
from itertools import cycle
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from experiments.claims import Claim, load_claims
from experiments.comparison import CRITERIA, PAPER, PROPERTIES
from experiments.config import experiment_names, load
from figures import FIGURES
from report.__main__ import main

REPLICATES = 3
VERDICTS = ("reproduced", "not reproduced", "reproduced", "inconclusive", "reproduced")
MACHINE = {
    "packages": {"numpy": "2.4.6"},
    "git": {"commit": "c0ffee", "dirty": False},
    "python": "3.11.7",
    "platform": "Linux",
}


def png(width: int, height: int) -> bytes:
    """A white picture."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    pixels = zlib.compress((b"\0" + b"\xff" * width) * height)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")
    )


def estimate(claim: Claim, number: int, verdict: str) -> dict[str, Any]:
    centre = -60.0 + number if claim.is_percentage else round(0.3 + 0.01 * number, 3)
    return {"ours": centre, "low": centre - 0.125, "high": centre + 0.125, "verdict": verdict}


def write_results(results: Path, *overrides: str) -> None:
    """Write all that the page is made of, for the claims of configs/claims.yaml."""
    for name in ("figures", "tables", "trials", "replicates", "benchmarks"):
        (results / name).mkdir(parents=True)
    claims = load_claims()
    verdicts = cycle(VERDICTS)
    rows = []
    for number, claim in enumerate(claims.claims.values()):
        names = ("id", "source", "figure", "statement")
        row: dict[str, Any] = {name: getattr(claim, name) for name in names}
        row |= {"statistic": claim.describe(), "paper": claim.paper, "replicates": REPLICATES}
        row["criterion"] = claim.criterion or "the paper's number"
        row |= estimate(claim, number, next(verdicts))
        if claim.has_ranges:
            other = estimate(claim, -number, "inconclusive")
            row |= {f"{key}_of_means": value for key, value in other.items()}
        rows.append(row)
    pd.DataFrame(rows).to_csv(results / "claims.csv", index=False)

    evidence = []
    for decision in claims.decisions:
        for place, reading in enumerate(decision.readings):
            verdict = "inconclusive" if place else "reproduced"
            for number, name in enumerate(decision.claims):
                row = {"decision": decision.id, "reading": reading.reading, "claim": name}
                evidence.append(row | estimate(claims.claims[name], number, verdict))
    pd.DataFrame(evidence).to_csv(results / "tables" / "decisions.csv", index=False)

    cells = [
        {"metric": metric, "property": name, "paper": "yes" if answer else "no", "ours": "yes"}
        | {"agrees": "yes" if answer else "no", "statistic": "tau", "value": 0.25}
        | {"criterion": criterion, "experiment": "outliers"}
        for metric, answers in PAPER.items()
        for name, criterion, answer in zip(PROPERTIES, CRITERIA, answers, strict=True)
    ]
    cells[-1] |= {"ours": "not tested", "agrees": None, "value": None, "experiment": None}
    pd.DataFrame(cells).to_csv(results / "tables" / "method_comparison.csv", index=False)

    for name in FIGURES:
        (results / "figures" / f"{name}.png").write_bytes(png(990, 930))
    place = f"results_dir={results}"
    for name in experiment_names():
        record = {"config": asdict(load([f"experiment={name}", place, *overrides])), **MACHINE}
        (results / "trials" / f"{name}.json").write_text(json.dumps(record))
    for number in range(REPLICATES):
        config = load(["experiment=outliers", f"replicate={number}", place, *overrides])
        record = {"config": asdict(config), **MACHINE}
        (results / "replicates" / f"{number}.json").write_text(json.dumps(record))
        benchmark = f"s\tcpu_time\tmax_rss\n{50 + number}.0\t-\t100.4\n"
        (results / "benchmarks" / f"replicate_{number}.tsv").write_text(benchmark)
    (results / "benchmarks" / "replicate_99.tsv").write_text("s\n4000.0\n")  # of another run


@dataclass
class Element:
    """An element of a page with all text in it."""

    tag: str
    attributes: dict[str, str | None]
    parents: tuple["Element", ...]
    pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        return " ".join("".join(self.pieces).split())

    def get(self, name: str) -> str:
        return self.attributes.get(name) or ""


class Page(HTMLParser):
    """The elements of a page in their order."""

    VOID = ("meta", "img", "br", "path", "rect", "circle")

    def __init__(self, html: str) -> None:
        super().__init__()
        self.html = html
        self.elements: list[Element] = []
        self.open: list[Element] = []
        self.feed(html)
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = [name for name, _ in attrs]
        assert len(names) == len(set(names)), f"an attribute twice in <{tag}>"
        self.elements.append(Element(tag, dict(attrs), tuple(self.open)))
        if tag not in self.VOID:
            self.open.append(self.elements[-1])

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append(Element(tag, dict(attrs), tuple(self.open)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop().tag == tag

    def handle_data(self, data: str) -> None:
        for element in self.open:
            element.pieces.append(data)

    def all(self, *tags: str) -> list[Element]:
        return [element for element in self.elements if element.tag in tags]

    def id(self, name: str) -> Element:
        (element,) = [element for element in self.elements if element.get("id") == name]
        return element

    def within(self, outer: Element, *tags: str) -> Iterator[Element]:
        return (element for element in self.all(*tags) if outer in element.parents)


@pytest.fixture(scope="session")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("original") / "results"
    write_results(directory)
    return directory


@pytest.fixture
def results(original: Path, tmp_path: Path) -> Path:
    """A results folder to be changed at will."""
    return Path(shutil.copytree(original, tmp_path / "results"))


@pytest.fixture
def make_page() -> Callable[[Path], Page]:
    """Make the page of a results folder and read it."""

    def make(results: Path) -> Page:
        assert main([f"results_dir={results}"]) == 0
        return Page((results / "report.html").read_text(encoding="utf-8"))

    return make


@pytest.fixture(scope="session")
def page(tmp_path_factory: pytest.TempPathFactory) -> Page:
    """The page of a results folder that nothing is changed in."""
    results = tmp_path_factory.mktemp("report") / "results"
    write_results(results, "trials=7")
    assert main([f"results_dir={results}"]) == 0
    return Page((results / "report.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def table(page: Page) -> pd.DataFrame:
    """What ``claims.csv`` has behind that page, made anew."""
    verdicts = cycle(VERDICTS)
    claims = load_claims().claims.values()
    return pd.DataFrame(
        [{"id": claim.id, "source": claim.source, "verdict": next(verdicts)} for claim in claims]
    )
