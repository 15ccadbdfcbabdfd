"""The sections of the studies show what their tables hold."""

from base64 import b64decode
from io import BytesIO

import numpy as np
from PIL import Image


def test_differences_are_marked_where_they_are_certain_and_in_the_right_direction(page):
    section = page.id("threshold_study")
    (table,) = [t for t in page.within(section, "table") if "values" in t.get("class")]
    cells = [cell for row in page.within(table, "tr") for cell in page.cells(row)]
    marked = [cell for cell in cells if "▲" in cell or "▼" in cell]
    assert marked == ["0.2 % ▼worse", "0.750 ▲better", "12.5 % ▼worse"]


def test_failures_are_easy_to_see(page, original):
    rows = [row for row in page.all("tr") if row.get("id").startswith("scenario-")]
    scenarios = original.plans["beyond"].tables
    assert [row.get("id") for row in rows] == [f"scenario-{name}" for name in scenarios]
    failing = [row.get("id") for row in rows if "fails: outliers 48" in row.text]
    assert failing == ["scenario-uneven", "scenario-two_pieces"]


def test_scenarios_have_their_settings(page):
    first = page.id("scenario-paper").text
    assert "cameras: cube; errors: gaussian; outliers: uniform; number of cameras: 100" in first
    strong = page.id("scenario-strong_drift").text
    assert "cameras: car; errors: drift; σt: 0.5, 1, 2, 3, 5; σr, degrees: 5, 10, 20" in strong
    assert "outliers: uniform" not in strong


OWN = """\
settings: {metrics: [ATE, TAS], n_outliers: [0, 4], sigma_t: [0.01], sigma_r_deg: [1]}
scenarios:
  circle: {geometry: orbit}
  wrong_merge: {geometry: orbit, outliers: cluster}
"""


def test_own_values_and_scenarios_are_shown(make_results, tmp_path):
    (tmp_path / "mine.yaml").write_text(OWN)
    page = make_results("tas_quantile=[0.5,0.9]", f"scenarios={tmp_path / 'mine.yaml'}").page()
    values = [header.text for header in page.within(page.id("threshold_study"), "th")]
    title = values.index("TAS: quantile that is d")
    assert values[title + 1 : title + 4] == ["0.5", "● 0.75, the paper’s", "0.9"]
    assert "cameras: orbit" in page.id("scenario-circle").text
    assert "outliers: cluster" in page.id("scenario-wrong_merge").text
    assert page.id("figure-beyond_mine").text.startswith("Figure ")


def test_metrics_are_ranked(page):
    section = page.id("head_to_head").text
    assert "mAA 90.0 > TAS 80.0" in section
    assert "mAA 9, TAS ∞" in section


def test_pictures_are_the_figures(results):
    levels = np.linspace(0, 255, 64).astype(np.uint8)
    picture = np.stack(np.broadcast_arrays(levels[:, None], levels[None, :], np.uint8(90)), -1)
    Image.fromarray(picture).save(results.folder / "figures" / "paths.png")
    page = results.page()
    (image,) = page.within(page.id("figure-paths"), "img")
    content = b64decode(image.get("src").partition(",")[2])
    assert (image.get("width"), image.get("height")) == ("64", "64")
    shown = np.asarray(Image.open(BytesIO(content)).convert("RGB"), dtype=float)
    assert np.abs(shown - picture).mean() < 8  # 4096 colours shown in 256
