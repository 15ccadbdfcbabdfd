"""The sections of the studies say what their tables say."""

import re
from base64 import b64decode
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from experiments.scenarios import load_study as load_scenarios
from experiments.study import load_study
from report.__main__ import main


def cells(page: Any, row: Any) -> list[str]:
    return [cell.text for cell in page.within(row, "td")]


def row_of(page: Any, section: str, header: str, table: str = "table") -> Any:
    """The only row of a section whose header has this text."""
    found = [
        row
        for row in page.within(page.id(section), "tr")
        for cell in page.within(row, "th")
        if cell.text == header and cell.get("scope") == "row"
        if any(table in parent.get("class") or table == parent.tag for parent in row.parents)
    ]
    (row,) = found
    return row


def test_every_value_of_every_choice_stands_there_and_the_papers_is_marked(page: Any) -> None:
    section = page.id("thresholds")
    (table,) = [t for t in page.within(section, "table") if "values" in t.get("class")]
    rows = [row for row in page.within(table, "tr") if list(page.within(row, "td"))]
    axes = load_study("threshold").axes.values()
    values = [(value == axis.paper, value) for axis in axes for value in axis.values]
    assert len(rows) == len(values) == 45
    for row, (is_paper, value) in zip(rows, values, strict=True):
        (header,) = page.within(row, "th")
        assert header.text.endswith(", the paper’s") == is_paper
        assert (row.get("class") == "paper") == is_paper
        assert value in header.text or header.text in ("exact area", "off")
        assert len(cells(page, row)) == 7
    titles = [th.text for th in page.within(table, "th") if th.get("scope") == "rowgroup"]
    assert len(titles) == 9
    assert titles[0] == "TAS: largest threshold, units of d"


def test_differences_are_marked_where_they_are_certain_and_in_the_right_direction(
    page: Any,
) -> None:
    section = page.id("thresholds")
    (table,) = [t for t in page.within(section, "table") if "values" in t.get("class")]
    rows = [cells(page, row) for row in page.within(table, "tr")][2:]
    assert rows[0] == ["0.500", "0.500", "0.500", "0.500", "0.5 %", "0.5000", "1.25 ms"]
    changed = ["0.750 ▲better", "0.250 ▼worse", "0.509", "0.500", "12.5 % ▼worse", "–", "2.25 ms"]
    assert rows[1] == changed
    marked = [cell for row in rows for cell in row if "▲" in cell or "▼" in cell]
    assert len(marked) == 3


def test_costs_and_gains_are_told(page: Any) -> None:
    section = page.id("thresholds")
    assert "1 cost something that another value would give, and 1 gain" in section.text
    assert "No cost shows for the quantile that is d (TAS), number of thresholds (TAS), " in (
        section.text
    )
    assert "weight of the TAS (PAS), hypotheses (TAS), prescreening threshold (TAS) and m as" in (
        section.text
    )
    row = row_of(page, "thresholds", "TAS: largest threshold, units of d", "trades")
    paper, costs, gains = cells(page, row)
    assert paper == "1 against 0.25, 0.5, 2, 4"
    assert costs == "τ with noise 0.500 instead of 0.750 at 0.5"
    assert gains == (
        "τ with outliers 0.500 against 0.250 at 0.5 "
        "dependence on cameras 0.5 % against 12.5 % at 0.5"
    )
    row = row_of(page, "thresholds", "TAS: prescreening threshold", "trades")
    nothing = "nothing that these trials can tell"
    assert cells(page, row) == ["0.1 against 0.03, 0.3, off", nothing, nothing]


def test_registrations_are_compared_and_their_meanings_told_apart(page: Any) -> None:
    parts = [part for part in load_study("registration").parts.values() if part.seeds]
    n = sum(len(part.config.n_outliers) * len(part.config.sigma_t) for part in parts)
    without = sum(len(part.config.sigma_t) for part in parts)
    section = page.id("registrations")
    assert f"on {n - without} of {n} inputs by more than 0.003" in section.text
    assert "With the refined registration it does on none." in section.text
    assert f"higher on {n} of {n} inputs (+0.125 in the median, +0.1250 to +0.125)" in section.text
    assert "does not compare with published TAS values" in section.text

    def numbers(header: str) -> list[list[str]]:
        rows = [row for row in page.within(section, "tr") if row.text.startswith(header)]
        return [cells(page, row) for row in rows]

    assert numbers("Standard deviation over the seeds, median") == [["0.01000", "0.00010"]]
    assert numbers("Inputs on which") == [[f"{n - without}", "0"]]
    assert numbers("Mean score") == [["0.500", "0.625"]]
    assert numbers("Mean τ with noise") == [["0.500", "0.750"]] * 3
    assert numbers("Smallest τ with noise") == [["0.250", "0.625"]] * 3
    assert numbers("Dependence on the number of cameras") == [["12.5", "7.2"]] * 3
    assert numbers("500 cameras") == [["1.25 ms", "2.25 ms"]]
    assert numbers("37 in a cube, 11 outliers, σt 0.03") == [["0.5000 ± 0.0100", "0.6250 ± 0.0001"]]
    (details,) = page.within(section, "details")
    assert len([row for row in page.within(details, "tr") if list(page.within(row, "td"))]) == n


def test_failures_are_easy_to_see(page: Any) -> None:
    section = page.id("beyond")
    scenarios = load_scenarios().scenarios
    lead = "errors and outliers, the TAS fails in 2, the RAS in 0 and the PAS in 0."
    assert f"Of {len(scenarios)} scenarios with other camera paths, {lead}" in section.text
    (terms,) = [dl for dl in page.within(section, "dl") if "failures" in dl.get("class")]
    links = [link.get("href") for link in page.within(terms, "a")]
    assert links == ["#scenario-uneven", "#scenario-two_pieces"]
    assert "TAS fails uneven (outliers −0.12), two pieces (outliers −0.12)" in terms.text
    assert "RAS fails nowhere" in terms.text
    rows = [row for row in page.all("tr") if row.get("id").startswith("scenario-")]
    assert [row.get("id") for row in rows] == [f"scenario-{name}" for name in scenarios]
    for row in rows:
        failed = row.get("id") in ("scenario-uneven", "scenario-two_pieces")
        marked = [cell for cell in page.within(row, "td") if "fails" in cell.get("class")]
        assert [cell.get("data-label") for cell in marked] == ["TAS"] * failed
        assert ("fails: outliers −0.12" in row.text) == failed


def test_scenarios_tell_their_settings_and_findings(page: Any) -> None:
    first = page.id("scenario-paper").text
    assert "cameras: cube; errors: gaussian; outliers: uniform; number of cameras: 100" in first
    assert "outliers: 0, 10, 20, 30, 50; σt: 0.01, 0.03, 0.05, 0.07, 0.1; σr" in first
    for section in ("thresholds", "registrations", "beyond"):
        assert "7 trials in each cell" in page.id(section).text  # as they were run
    strong = page.id("scenario-strong_drift").text
    assert "cameras: car; errors: drift; σt: 0.5, 1, 2, 3, 5; σr, degrees: 5, 10, 20" in strong
    assert "outliers: uniform" not in strong
    assert "ATE < all: τ −0.25 in strong_drift." in strong  # escaped, or it would be a tag
    assert "side of the outliers’ cube: 1 " in page.id("scenario-near_outliers").text


def test_a_score_that_fails_everywhere_and_one_that_has_no_levels(
    results: Path, make_page: Callable[[Path], Any]
) -> None:
    path = results / "tables" / "beyond.csv"
    table = pd.read_csv(path)
    table.loc[table["metric"] == "PAS", "noise_power"] = 0.25
    table["outlier_power"] = np.nan
    table.to_csv(path, index=False)
    section = make_page(results).id("beyond")
    n = len(load_scenarios().scenarios)
    assert f"the TAS fails in 0, the RAS in 0 and the PAS in {n}." in section.text
    assert "nan" not in section.text


OWN = """\
settings: {metrics: [ATE, TAS], n_outliers: [0, 4], sigma_t: [0.01], sigma_r_deg: [1]}
scenarios:
  circle: {geometry: orbit}
  wrong_merge: {geometry: orbit, outliers: cluster}
"""


@pytest.fixture
def own(results: Path, tmp_path: Path) -> tuple[Path, list[str]]:
    """A file of scenarios of one's own, and the command line for it and values of one's own."""
    file = tmp_path / "mine.yaml"
    file.write_text(OWN)
    settings = [f"results_dir={results}"]
    return file, [*settings, "tas_quantile=[0.5,0.75,0.9]", "--scenarios", str(file)]


def test_own_values_and_scenarios_are_shown(
    results: Path, own: tuple[Path, list[str]], make_page: Callable[..., Any]
) -> None:
    file, arguments = own
    from .conftest import write_studies

    write_studies(arguments[:1], arguments[1:2], file)
    (results / "figures" / "beyond.png").rename(results / "figures" / "beyond_mine.png")
    page = make_page(results, *arguments[1:])
    row = row_of(page, "thresholds", "TAS: quantile that is d", "trades")
    assert cells(page, row)[0] == "0.75 against 0.5, 0.9"
    assert "geometry" not in page.id("beyond").text
    assert "cameras: orbit" in page.id("scenario-circle").text
    assert "outliers: cluster" in page.id("scenario-wrong_merge").text
    assert "the TAS fails in 0." in page.id("beyond").text
    command = "snakemake report --config replicates=3 'tas_quantile=[0.5,0.75,0.9]'"
    assert f"{command} scenarios=mine.yaml" in page.id("provenance").text


def test_own_values_and_scenarios_are_missed_with_their_commands(
    results: Path, own: tuple[Path, list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    file, (place, axis, *scenarios) = own
    assert main([place, axis]) == 1
    error = capsys.readouterr().err
    assert (
        "threshold_study_tas.csv was made for something else: line 7 is not tas_quantile" in error
    )
    assert error.endswith(f"; run: python -m experiments.threshold_study {place} '{axis}'\n")
    assert main([place, *scenarios]) == 1
    error = capsys.readouterr().err
    assert "beyond_mine.csv does not exist" in error
    assert error.endswith(f"run: python -m experiments.findings --scenarios {file} {place}\n")
    file.write_text("scenarios: {a: {geometry: sphere}}")
    assert main([place, *scenarios]) == 2
    assert "scenario 'a'" in capsys.readouterr().err


def test_pictures_are_the_figures(results: Path, make_page: Callable[[Path], Any]) -> None:
    levels = np.linspace(0, 255, 64).astype(np.uint8)
    picture = np.stack(np.broadcast_arrays(levels[:, None], levels[None, :], np.uint8(90)), -1)
    Image.fromarray(picture).save(results / "figures" / "paths.png")
    page = make_page(results)
    (image,) = page.within(page.id("figure-paths"), "img")
    content = b64decode(image.get("src").partition(",")[2])
    assert (image.get("width"), image.get("height")) == ("64", "64")
    shown = np.asarray(Image.open(BytesIO(content)).convert("RGB"), dtype=float)
    difference = np.abs(shown - picture)
    assert difference.mean() < 8  # 4096 colours shown in 256
    assert len(re.findall("data:image/png", page.html)) == 11
