"""The section on people's own runs, from files of made runs to the page."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from studies.__main__ import main as answer
from studies.real import STUDY
from studies.real.figure import draw

from .conftest import SETTINGS, Results, write_results

FILE = """\
format: tum
reference: "{sequence}/gt.txt"
estimate: "{sequence}/{system}/{run}.txt"
"""
SYSTEMS = {"steady": 0.02, "drifting": 0.1}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """All results, with those of two systems that ran three times on two sequences."""
    folder = tmp_path_factory.mktemp("real")
    rng = np.random.default_rng(0)
    for sequence in ("desk", "room"):
        positions = rng.normal(size=(40, 3)).cumsum(axis=0)
        write(folder / sequence / "gt.txt", positions, np.zeros((40, 3)))
        for system, scale in SYSTEMS.items():
            for run in range(3):
                errors = rng.normal(scale=scale, size=(2, 40, 3)).cumsum(axis=1)
                path = folder / sequence / system / f"{run}.txt"
                write(path, positions + errors[0], errors[1] / 10)
    (folder / "mine.yaml").write_text(FILE)
    results = Results(folder / "results", (*SETTINGS, f"benchmark={folder / 'mine.yaml'}"))
    write_results(results)
    own = [results.folder / f"real/own/{sequence}.csv" for sequence in ("desk", "room")]
    for path in own:
        path.parent.mkdir(parents=True, exist_ok=True)
        given = ["--settings", f"benchmark={folder / 'mine.yaml'}", "more=[rpe@5f,TAS]"]
        assert answer(["real", "--part", path.stem, *given, "--output", str(path)]) == 0
    answers = [str(results.folder / name) for name in results.plans["real"].answers]
    assert answer(["real", "--own", *map(str, own), "--output", *answers]) == 0
    tables = [pd.read_csv(path) for path in answers[:-1]]
    draw(*tables).savefig(results.folder / "figures/real.png", dpi=300)
    return results


def write(path: Path, positions: np.ndarray, turns: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    quaternions = Rotation.from_rotvec(turns).as_quat()
    np.savetxt(path, np.column_stack([np.arange(40) / 10, positions, quaternions]))


@pytest.mark.slow
def test_the_section_shows_the_tables_the_sentences_and_the_figure(made: Results) -> None:
    page = made.page()
    section = page.id("real")
    assert [a.text for a in page.all("a") if a.get("href") == "#real"] == [STUDY.title]
    assert "4 pairs" not in section.text
    assert "2 pairs of systems and sequences" in section.text
    assert "drifting, steady on 2 sequences" in section.text
    table = pd.read_csv(made.folder / "tables/real.csv").set_index("metric")
    rows = {page.within(row, "th")[0].text: page.cells(row) for row in page.within(section, "tr")}
    rows.pop("Metric")
    assert list(rows) == list(table.index)
    assert {"TAS", "ATE", "mAA", "rpe@5f"} <= set(rows)
    for metric, cells in rows.items():
        needed = table.loc[metric, "runs"]
        assert cells[0] == (f"{needed:.0f}" if np.isfinite(needed) else "> 1000")
        assert cells[2] == f"{table.loc[metric, 'order']:.0f}"
    assert float(rows["TAS"][2]) > 90  # five times the drift
    told = [item.text for item in page.within(section, "li")]
    assert sum(sentence.endswith("as another run.") for sentence in told) > 1
    (image,) = page.within(section, "img")
    assert len(image.get("alt")) > 80
