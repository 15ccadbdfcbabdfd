"""The sections of the studies say what their tables say."""

import re
from base64 import b64decode
from io import BytesIO

import numpy as np
from PIL import Image

from studies.axes import axes_of
from studies.study import plans
from studies.threshold_study import THRESHOLDS
from studies.threshold_study.words import TERMS


def row_of(page, section, header, table="table"):
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


def test_every_value_of_every_choice_stands_there_and_the_papers_is_marked(page, original):
    section = page.id("threshold_study")
    (table,) = [t for t in page.within(section, "table") if "values" in t.get("class")]
    rows = [row for row in page.within(table, "tr") if list(page.within(row, "td"))]
    tables = original.plans["threshold_study"].tables
    metrics = {name: table.sweeps[0].metrics for name, table in tables.items()}
    axes = axes_of(THRESHOLDS, metrics)
    values = [(value == axis.paper, value) for axis in axes for value in axis.values]
    assert len(rows) == len(values) == 45
    for row, (is_paper, value) in zip(rows, values, strict=True):
        (header,) = page.within(row, "th")
        assert header.text.endswith(", the paper’s") == is_paper
        assert (row.get("class") == "paper") == is_paper
        assert value in header.text or header.text in ("exact area", "off")
        assert len(page.cells(row)) == 7
    titles = [th.text for th in page.within(table, "th") if th.get("scope") == "rowgroup"]
    assert len(titles) == 9
    assert titles[0] == "TAS: largest threshold, units of d"


def test_differences_are_marked_where_they_are_certain_and_in_the_right_direction(page):
    section = page.id("threshold_study")
    (table,) = [t for t in page.within(section, "table") if "values" in t.get("class")]
    rows = [page.cells(row) for row in page.within(table, "tr")][2:]
    assert rows[0] == ["0.5 %", "0.5 %", "0.5 %", "0.500", "0.5 %", "0.5000", "1.25 ms"]
    changed = ["0.5 %", "0.2 % ▼worse", "0.5 %", "0.750 ▲better", "12.5 % ▼worse", "–", "2.25 ms"]
    assert rows[1] == changed
    marked = [cell for row in rows for cell in row if "▲" in cell or "▼" in cell]
    assert len(marked) == 3


def test_costs_and_gains_are_told(page):
    section = page.id("threshold_study")
    assert "1 cost something that another value would give, and 1 gain" in section.text
    assert (
        "No cost shows for these: quantile that is d (TAS), number of thresholds (TAS), largest "
        "threshold, degrees (RAS), number of thresholds (RAS), weight of the TAS (PAS), hypotheses "
        "(TAS), prescreening threshold (TAS), m as share of n (TAS)."
    ) in section.text
    bold = [strong.text for strong in page.within(section, "strong")][:2]
    assert bold == ["1 cost something", "1 gain something"]
    assert all(term in section.text for term in map(" ".join, TERMS.items()))
    row = row_of(page, "threshold_study", "TAS: largest threshold, units of d", "trades")
    paper, costs, gains = page.cells(row)
    assert paper == "1 against 0.25, 0.5, 2, 4"
    assert costs == "range over noise 0.500 instead of 0.750 at 0.5"
    assert gains == (
        "order of outliers 0.5 % against 0.2 % at 0.5 "
        "dependence on cameras 0.5 % against 12.5 % at 0.5"
    )
    row = row_of(page, "threshold_study", "TAS: prescreening threshold", "trades")
    nothing = "nothing that these trials can tell"
    assert page.cells(row) == ["0.1 against 0.03, 0.3, off", nothing, nothing]


def test_failures_are_easy_to_see(page, original):
    section = page.id("beyond")
    scenarios = original.plans["beyond"].tables
    lead = "errors and outliers, the TAS fails in 2, the RAS in 0 and the PAS in 0."
    assert f"Of {len(scenarios)} scenarios with other camera paths, {lead}" in section.text
    (terms,) = [dl for dl in page.within(section, "dl") if "failures" in dl.get("class")]
    links = [link.get("href") for link in page.within(terms, "a")]
    assert links == ["#scenario-uneven", "#scenario-two_pieces"]
    assert "TAS fails uneven (outliers 48), two pieces (outliers 48)" in terms.text
    assert "RAS fails nowhere" in terms.text
    rows = [row for row in page.all("tr") if row.get("id").startswith("scenario-")]
    assert [row.get("id") for row in rows] == [f"scenario-{name}" for name in scenarios]
    for row in rows:
        failed = row.get("id") in ("scenario-uneven", "scenario-two_pieces")
        marked = [cell for cell in page.within(row, "td") if "fails" in cell.get("class")]
        assert [cell.get("data-label") for cell in marked] == ["TAS"] * failed
        assert ("fails: outliers 48" in row.text) == failed


def test_scenarios_tell_their_settings_and_findings(page):
    first = page.id("scenario-paper").text
    assert "cameras: cube; errors: gaussian; outliers: uniform; number of cameras: 100" in first
    assert "outliers: 0, 10, 20, 30, 50; σt: 0.01, 0.03, 0.05, 0.07, 0.1; σr" in first
    for section in ("threshold_study", "beyond"):
        assert "7 trials in each cell" in page.id(section).text  # as they were run
    strong = page.id("scenario-strong_drift").text
    assert "cameras: car; errors: drift; σt: 0.5, 1, 2, 3, 5; σr, degrees: 5, 10, 20" in strong
    assert "outliers: uniform" not in strong
    assert "ATE < all: noise (−25 %) in strong_drift." in strong  # escaped, or it would be a tag
    assert "side of the outliers’ cube: 1 " in page.id("scenario-near_outliers").text


def test_a_score_that_fails_everywhere_and_one_that_has_no_levels(results):
    with results.table("tables/beyond.csv") as frame:
        frame.loc[frame["metric"] == "PAS", "noise_order"] = 25
        frame["outlier_order"] = np.nan
    section = results.page().id("beyond")
    n = len(results.plans["beyond"].tables)
    assert f"the TAS fails in 0, the RAS in 0 and the PAS in {n}." in section.text
    assert "nan" not in section.text


OWN = """\
settings: {metrics: [ATE, TAS], n_outliers: [0, 4], sigma_t: [0.01], sigma_r_deg: [1]}
scenarios:
  circle: {geometry: orbit}
  wrong_merge: {geometry: orbit, outliers: cluster}
"""


def test_own_values_and_scenarios_are_shown(make_results, tmp_path):
    (tmp_path / "mine.yaml").write_text(OWN)
    page = make_results("tas_quantile=[0.5,0.9]", f"scenarios={tmp_path / 'mine.yaml'}").page()
    row = row_of(page, "threshold_study", "TAS: quantile that is d", "trades")
    assert page.cells(row)[0] == "0.75 against 0.5, 0.9"
    assert "geometry" not in page.id("beyond").text
    assert "cameras: orbit" in page.id("scenario-circle").text
    assert "outliers: cluster" in page.id("scenario-wrong_merge").text
    assert "the TAS fails in 0." in page.id("beyond").text
    assert page.id("figure-beyond_mine").text.startswith("Figure 9 ")


def test_pictures_are_the_figures(results):
    levels = np.linspace(0, 255, 64).astype(np.uint8)
    picture = np.stack(np.broadcast_arrays(levels[:, None], levels[None, :], np.uint8(90)), -1)
    Image.fromarray(picture).save(results.folder / "figures" / "paths.png")
    page = results.page()
    (image,) = page.within(page.id("figure-paths"), "img")
    content = b64decode(image.get("src").partition(",")[2])
    assert (image.get("width"), image.get("height")) == ("64", "64")
    shown = np.asarray(Image.open(BytesIO(content)).convert("RGB"), dtype=float)
    difference = np.abs(shown - picture)
    assert difference.mean() < 8  # 4096 colours shown in 256
    assert len(re.findall("data:image/png", page.html)) == sum(
        len(plan.figures) for plan in plans().values()
    )
