"""The section on user-supplied runs, from tables made by hand to the page."""

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from studies.__main__ import main as answer

from .conftest import SETTINGS, Results, write_results


@pytest.fixture
def made(tmp_path):
    """All results, with those of two systems that ran three times on two sequences."""
    for name in ("desk/gt", "room/gt", *(f"desk/{s}/{run}" for s in "ab" for run in range(3))):
        path = tmp_path / f"{name}.txt"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    (tmp_path / "mine.yaml").write_text(
        'format: tum\nreference: "{sequence}/gt.txt"\nestimate: "{sequence}/{system}/{run}.txt"\n'
    )
    results = Results(tmp_path / "results", (*SETTINGS, f"benchmark={tmp_path / 'mine.yaml'}"))
    write_results(results)
    rng = np.random.default_rng(0)
    own = pd.DataFrame(
        {"sequence": sequence, "system": system, "run": str(run), "change": "as it is"}
        | {"TAS": 0.5 + 0.3 * (system == "a") + 0.01 * run, "ATE": rng.normal()}
        for sequence in ("desk", "room")
        for system in "ab"
        for run in range(3)
    )
    results.write("real/own/both.csv", own)
    answers = [str(results.folder / name) for name in results.plans["real"].answers]
    path = str(results.folder / "real/own/both.csv")
    assert answer(["real", "--own", path, "--output", *answers]) == 0
    Image.new("L", (2070, 20), 255).save(results.folder / "figures/real.png")
    return results


def test_the_section_shows_the_table_and_the_figure(made):
    page = made.page()
    section = page.id("real")
    assert len([a for a in page.all("a") if a.get("href") == "#real"]) == 1
    table = pd.read_csv(made.folder / "tables/real.csv").set_index("metric")
    rows = {page.within(row, "th")[0].text: page.cells(row) for row in page.within(section, "tr")}
    rows.pop("Metric")
    assert list(rows) == list(table.index) == ["TAS", "ATE"]
    assert rows["TAS"][2] == "100"
    assert len(page.within(section, "img")) == 1
