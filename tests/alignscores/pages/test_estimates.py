"""The page of estimates in a browser: it draws, and its numbers are Python's."""

import json
import os

import numpy as np
import pytest

from alignscores import evaluate, pas

from ..conftest import AT_STAMPS, FILES, TUM

READ = """() => {
  const text = (id) => document.getElementById(id).textContent;
  const all = (selector) => [...document.querySelectorAll(selector)];
  return {
    table: all("#rows tr").map((row) => [...row.cells].map((cell) => cell.textContent.trim())),
    ...Object.fromEntries(["setting", "notes", "title", "kicker"].map((id) => [id, text(id)])),
    drawn: all(".chart").filter((chart) => chart.querySelector("path[d*=M]")).length,
  };
}"""


@pytest.fixture
def saved(run, tmp_path):
    """(arguments) -> the page, and the JSON output of the same run."""

    def saved(*arguments):
        path = tmp_path / "page.html"
        code, out, _ = run(*arguments, "--save_page", path, "--json")
        assert code == 0
        return path.read_text("utf-8"), json.loads(out)["results"]

    return saved


@pytest.fixture
def shown(browse):
    """(page) -> what stands on the page."""
    return lambda html: browse(html).evaluate(READ)


@pytest.mark.parametrize("form", ["tum", "colmap"])
def test_the_page_has_the_numbers_of_the_command_and_draws(saved, shown, form):
    options = ("--missing", "ignore") if form == "colmap" else ()
    html, (result,) = saved(form, *FILES[form], *options)
    page = shown(html)
    (row,) = page["table"]
    assert row[1:4] == [f"{result[name]:.3f}" for name in ("TAS", "RAS", "PAS")]
    assert float(row[4]) == pytest.approx(result["half_distance"], rel=0.01)
    assert row[-1] == f"{100 * (1 - result['lost']):.1f}%"
    assert page["setting"].endswith(": as in the run.")
    assert page["drawn"] == 7  # errors, the band, cumulative errors and profiles
    assert f"d = {result['unit']:.3g} " in page["kicker"]


def test_sliders_change_the_scores_to_those_of_python(saved, browse, examples):
    """The registration of the paper depends on no threshold."""
    options = "--registration", "pcr99", *AT_STAMPS, "--missing", "ignore"
    html, _ = saved(*TUM, *options)
    page = browse(html)
    first, given = page.evaluate(READ), {}
    for name in ("threshold", "degrees", "weight"):
        page.locator(f"#{name}").press("PageDown")
        given[name] = float(page.locator(f"output[for={name}]").inner_text().split()[0])
    files = (examples / name for name in TUM[1:])
    poses = evaluate(*files, sync="nearest", max_gap=0.0, missing="ignore").matches
    expected = pas(
        poses.gt_poses,
        poses.est_poses,
        unit=poses.unit,
        max_threshold=given["threshold"],
        max_threshold_deg=given["degrees"],
        weight=given["weight"],
    )
    moved = page.evaluate(READ)
    scores = expected.tas.score, expected.ras.score, expected.score
    assert 0 < min(scores) < max(scores) < 1
    assert moved["table"][0][1:4] == [f"{score:.3f}" for score in scores]
    assert moved["setting"].endswith("not as in the run.")
    page.locator("#reset").click()
    assert page.evaluate(READ) == first != moved


def test_trajectories_rotate_and_mark_the_frame_that_is_pointed_at(saved, browse):
    page = browse(saved(*TUM)[0])
    scene, errors = page.locator("#scene"), page.locator("[role=slider]").first
    images = [scene.evaluate("scene => scene.toDataURL()")]
    for place, key in ((scene, "ArrowLeft"), (errors, "Home"), (scene, "Home"), (errors, "End")):
        place.press(key)
        images.append(scene.evaluate("scene => scene.toDataURL()"))
    assert len(set(images)) == 5
    page.locator("[name=colour][value=estimate]").check()
    assert scene.evaluate("scene => scene.toDataURL()") not in images


def test_several_estimates_are_overlaid(saved, shown):
    html, _ = saved(*TUM, TUM[1])
    page = shown(html)
    assert [row[0] for row in page["table"]] == ["estimate.txt", "reference.txt"]
    assert page["title"] == "estimate.txt, reference.txt against reference.txt"


def test_positions_alone_have_no_charts_of_rotations(saved, shown, examples, tmp_path):
    path = tmp_path / "positions.txt"
    np.savetxt(path, np.loadtxt(examples / "tum/estimate.txt")[:, :4], "%.6f")
    alone = shown(saved("tum", examples / "tum/reference.txt", path)[0])
    ((_, tas, *without),) = ([*row[:4], row[5], row[7]] for row in alone["table"])
    assert (float(tas) > 0, without) == (True, ["–"] * 4)
    both = shown(
        saved("tum", examples / "tum/reference.txt", examples / "tum/estimate.txt", path)[0]
    )
    assert (alone["drawn"], both["drawn"]) == (4, 7)
    assert both["table"][1][2] == "–" != both["table"][0][2]


@pytest.mark.skipif(os.name == "nt", reason="its files cannot have these names")
def test_names_are_text_and_paths_stay_private(saved, shown, examples, tmp_path):
    names = "<i>é.json", "<script><b>é\"&'.json"
    for name, file in zip(names, FILES["nerf"], strict=True):
        content = (examples / file).read_text().replace(".png", "</script><img src=x>")
        (tmp_path / name).write_text(content)
    html, _ = saved("nerf", *(tmp_path / name for name in names))
    page = shown(html)
    assert page["title"] == f"{names[1]} against {names[0]}"
    assert str(tmp_path) not in html
    assert {line for line in html.split('"') if "://" in line} == {"http://www.w3.org/2000/svg"}


def test_no_wider_than_the_screen(saved, browse):
    page = browse(saved(*TUM, TUM[1])[0])
    for width in (320, 390, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
