"""Results made up in a moment, with every verdict in them, and a page read back."""

from io import BytesIO
from itertools import cycle, islice

import numpy as np
import pandas as pd
import pytest
from bs4 import BeautifulSoup
from PIL import Image

from experiments.config import experiment_names, load_sweep
from experiments.tables import write_trials
from report.__main__ import main
from studies.claims.claims import load_claims
from studies.paper.table1 import CRITERIA, PAPER, PROPERTIES, ROWS
from tests.figures.conftest import FIGURES

TRIALS = 7
VERDICTS = ("reproduced", "not reproduced", "reproduced", "inconclusive", "reproduced")


def text_of(element):
    """Return all text in an element."""
    return " ".join(element.get_text().split())


def write_results(folder):
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


def numbers(verdicts):
    """Return the numbers and words of claims with these verdicts."""
    truths = {"reproduced": "true", "not reproduced": "false", "inconclusive": "open"}
    columns = {"ours": 0.5, "low": 0.4, "high": 0.6, "mean_low": 0.45, "mean_high": 0.55}
    return columns | {"verdict": verdicts, "population": [truths[word] for word in verdicts]}


def write(path, table):
    path.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(path, index=False)


@pytest.fixture(scope="session")
def make_page():
    def make(folder, *settings):
        html = folder / "report.html"
        assert main([str(folder), "--output", str(html), "--settings", *settings]) == 0
        return BeautifulSoup(html.read_text("utf-8"), "html.parser")

    return make


@pytest.fixture
def results(tmp_path):
    """A folder of results, to be changed at will."""
    write_results(tmp_path / "results")
    return tmp_path / "results"


@pytest.fixture(scope="session")
def page(tmp_path_factory, make_page):
    """The page of results in which nothing is changed."""
    folder = tmp_path_factory.mktemp("original")
    write_results(folder)
    return make_page(folder, "trials=7", "scenarios=/home/me/mine.yaml")
