"""Results made up in a moment, with every verdict in them, and a page read back."""

import shutil
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from html.parser import HTMLParser
from io import BytesIO
from itertools import cycle, islice
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from experiments.tables import write_trials
from report.__main__ import main
from studies.axes import axes_of
from studies.claims.claims import load_claims
from studies.paper import FIGURES
from studies.paper.table1 import CRITERIA, PAPER, PROPERTIES, ROWS
from studies.study import plans
from studies.threshold_study import THRESHOLDS
from studies.threshold_study.effects import COMPARED, EFFECTS

REPLICATES = 3
TRIALS = 7
SETTINGS = (f"trials={TRIALS}", f"replicates={REPLICATES}")
VERDICTS = ("reproduced", "not reproduced", "reproduced", "inconclusive", "reproduced")


@dataclass(eq=False)
class Element:
    """An element of a page with all text in it."""

    tag: str
    attributes: dict
    parents: tuple
    pieces: list = field(default_factory=list)
    inner: list = field(default_factory=list)

    @property
    def text(self):
        return " ".join("".join(self.pieces).split())

    def get(self, name):
        return self.attributes.get(name) or ""


class Page(HTMLParser):
    """The elements of a page in their order."""

    VOID = ("meta", "img", "br", "path", "rect", "circle")

    def __init__(self, html):
        super().__init__()
        self.html, self.elements, self.open = html, [], []
        self.feed(html)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        names = [name for name, _ in attrs]
        assert len(names) == len(set(names)), f"an attribute twice in <{tag}>"
        self.handle_startendtag(tag, attrs)
        self.open += self.elements[-1:] if tag not in self.VOID else []

    def handle_startendtag(self, tag, attrs):
        self.elements.append(Element(tag, dict(attrs), tuple(self.open)))
        for outer in self.open:
            outer.inner.append(self.elements[-1])

    def handle_endtag(self, tag):
        assert self.open.pop().tag == tag

    def handle_data(self, data):
        for element in self.open:
            element.pieces.append(data)

    def all(self, *tags):
        return [element for element in self.elements if element.tag in tags]

    def id(self, name):
        (element,) = [element for element in self.elements if element.get("id") == name]
        return element

    def within(self, outer, *tags):
        return [element for element in outer.inner if element.tag in tags]

    def cells(self, row):
        return [cell.text for cell in self.within(row, "td")]


@dataclass
class Results:
    """A folder of results, and the settings that they are made with."""

    folder: Path
    settings: tuple = SETTINGS

    @property
    def html(self):
        return self.folder / "report.html"

    @cached_property
    def plans(self):
        return plans(self.settings)

    def write(self, name, content):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, pd.DataFrame):
            content = content.to_csv(index=False)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())

    @contextmanager
    def table(self, name):
        """A table to be changed."""
        table = pd.read_csv(self.folder / name)
        yield table
        table.to_csv(self.folder / name, index=False)

    def arguments(self, *more):
        settings = ["--settings", *self.settings]
        return [str(self.folder), *more, "--output", str(self.html), *settings]

    def page(self, *more):
        assert main(self.arguments(*more)) == 0
        return Page(self.html.read_text(encoding="utf-8"))


def write_results(results):
    """Write all that the page is made of."""
    write_verdicts(results)
    for plan in results.plans.values():
        for name in plan.figures:
            picture = Image.new("L", (330, 310) if name in FIGURES else (2070, 20), 255)
            picture.save(buffer := BytesIO(), "PNG")
            results.write(f"figures/{name}.png", buffer.getvalue())
        for name, table in plan.tables.items():
            write_trials(results.folder / plan.folder / f"{name}.csv", pd.DataFrame(), table.sweeps)
    write_thresholds(results)
    write_findings(results)


def write_verdicts(results):
    claims = load_claims(REPLICATES)
    keys = ("id", "source", "figure", "statement", "paper")
    table = pd.DataFrame(
        {key: getattr(claim, key) for key in keys}
        | {"statistic": claim.describe(), "criterion": claim.criterion or "the paper's number"}
        | {"implied_by": " ".join(claim.implied_by) or None, "replicates": REPLICATES}
        for claim in claims.claims.values()
    )
    table = table.join(estimates(claims.claims.values(), VERDICTS))
    table["pooled"] = table["ours"]
    rows = estimates(claims.claims.values(), ["reproduced"])
    evidence = [rows.assign(decision="taken", reading="taken", claim=list(claims.claims))]
    for decision, reading, changed in claims.read():
        rows = estimates(changed.values(), ["inconclusive"])
        keys = {"decision": decision.id, "reading": reading.reading, "claim": list(changed)}
        evidence.append(rows.assign(**keys))
        words = dict.fromkeys(changed, "inconclusive, open")
        table[f"{decision.id}: {reading.reading}"] = table["id"].map(words)
    results.write("claims.csv", table)
    readings = pd.concat(evidence).assign(replicates=REPLICATES)
    results.write("tables/readings.csv", readings)
    criteria = [
        {"word": criterion.word, "bound": criterion.bound, "other": other, "claims": 9}
        | {"changed": 1, "population_changed": 2, "changes": "outliers-ate-blind: reproduced"}
        for criterion in claims.criteria
        for other in criterion.others
    ]
    criteria[-1] |= {"changed": 0, "changes": ""}
    results.write("tables/criteria.csv", pd.DataFrame(criteria))
    cells = [
        {
            "row": ROWS.get(metric, metric),
            "metric": metric,
            "property": name,
            "paper": "yes" if answer else "no",
            "ours": "yes",
        }
        | {"agrees": "yes" if answer else "no", "statistic": "tau", "value": 0.25}
        | {"criterion": criterion, "experiment": "outliers", "sensitivity": "tau 0.7: no"}
        for metric, answers in PAPER.items()
        for name, criterion, answer in zip(PROPERTIES, CRITERIA, answers, strict=True)
    ]
    cells[-1] |= dict.fromkeys(("agrees", "value", "experiment", "sensitivity"), None)
    cells[-1] |= {"ours": "not tested"}
    results.write("tables/method_comparison.csv", pd.DataFrame(cells))
    orders = pd.DataFrame(
        {"experiment": "outliers", "level": "noise", "metric": ["mAA", "TAS", "mAA"]}
        | {"versus": [None, None, "TAS"], "order": [90, 80, 10], "low": [89, 79, 9]}
        | {"high": [91, 81, 11], "p": [None, None, 0.001], "trials": [9, np.inf, None]}
        | {"cameras": None, "outliers": None}
    )
    results.write("tables/head_to_head.csv", orders)


def estimates(claims, verdicts):
    number = np.arange(len(claims))
    percentage = [claim.rule.is_percentage for claim in claims]
    ours = np.where(percentage, -60.0 + number, np.round(0.3 + 0.01 * number, 3))
    verdict = list(islice(cycle(verdicts), len(claims)))
    words = {"reproduced": "true", "not reproduced": "false", "inconclusive": "open"}
    return pd.DataFrame(
        {"ours": ours, "low": ours - 0.125, "high": ours + 0.125, "verdict": verdict}
        | {"mean_low": ours - 0.0625, "mean_high": ours + 0.0625}
        | {"population": [words[found] for found in verdict]}
    )


def sweeps_of(results, study):
    return {part: table.sweeps[0] for part, table in results.plans[study].tables.items()}


def metrics_of(sweeps):
    return {part: sweep.metrics for part, sweep in sweeps.items()}


def write_thresholds(results):
    """All effects are 0.5 but for TAS with half the largest threshold."""
    axes = axes_of(THRESHOLDS, metrics_of(sweeps_of(results, "threshold_study")))
    table = pd.DataFrame(
        {"axis": axis.name, "value": value, "paper": "yes" if value == axis.paper else "no"}
        | dict.fromkeys(EFFECTS, 0.5)
        | {f"{name}_error": 0.01 for name in COMPARED}
        | {f"{name}_p": np.nan if value == axis.paper else 0.01 for name in COMPARED}
        for axis in axes
        for value in axis.values
    )
    row = (table["axis"] == "tas_max_threshold") & (table["value"] == "0.5")
    changed = ["noise_range_of_means", "outlier_order", "camera_dependence"]
    table.loc[row, changed] = 0.75, 0.25, 12.5
    table.loc[row, ["majority_order", "seed_noise"]] = 0.509, np.nan
    for kind, rows in table.groupby(table["axis"].str.partition("_")[0], sort=False):
        results.write(f"tables/threshold_study_{kind}.csv", rows)


def write_findings(results):
    """The TAS fails in two scenarios."""
    findings = pd.DataFrame(
        {"scenario": name, "metric": metric, "noise_order": 87.5, "outlier_order": 75.0}
        | {"mean": 0.5}
        for name, sweep in sweeps_of(results, "beyond").items()
        for metric in sweep.metrics
    )
    fails = findings["metric"].eq("TAS") & findings["scenario"].isin(["uneven", "two_pieces"])
    findings.loc[fails, "outlier_order"] = 47.5
    results.write(f"tables/{results.plans['beyond'].called}.csv", findings)


@pytest.fixture(scope="session")
def original(tmp_path_factory):
    results = Results(tmp_path_factory.mktemp("original") / "results")
    write_results(results)
    return results


@pytest.fixture
def results(original, tmp_path):
    """Results to be changed at will."""
    return Results(shutil.copytree(original.folder, tmp_path / "results"))


@pytest.fixture
def make_results(tmp_path):
    """Make results with other settings: ``make_results("tas_quantile=[0.5]")``."""

    def make(*settings):
        results = Results(tmp_path / "own", (*SETTINGS, *settings))
        write_results(results)
        return results

    return make


@pytest.fixture(scope="session")
def page(original):
    """The page of results that nothing is changed in."""
    return original.page()


@pytest.fixture(scope="session")
def table(original):
    """The verdicts behind that page."""
    return pd.read_csv(original.folder / "claims.csv")
