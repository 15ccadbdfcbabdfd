"""The page of estimates in a browser: it draws, and its numbers are the command's."""

import json
import os
import re

import numpy as np
import pytest

from alignscores import evaluate, tas_profile

from ..conftest import FILES, TUM

READ = """() => {
  const all = (selector) => [...document.querySelectorAll(selector)];
  return {
    table: all("tbody tr").map((row) => [...row.cells].map((cell) => cell.textContent)),
    header: all("thead th").map((cell) => cell.textContent),
    title: document.querySelector("h1").textContent,
    conditions: document.querySelector("header p").textContent,
    curves: all(".plot").map((plot) => plot.querySelectorAll("path.curve").length),
    bands: all(".rows > svg").map((band) => [...band.children].map((r) => r.className.baseVal)),
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
def test_the_page_has_the_table_of_the_command_and_draws(run, saved, shown, form, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    options = ("--missing", "ignore") if form == "colmap" else ()
    html, (result,) = saved(form, *FILES[form], *options)
    page = shown(html)
    header, row = run(form, *FILES[form], *options)[1].splitlines()[:2]
    assert page["header"] == re.split("  +", header)
    assert page["table"] == [re.split("  +", row)]
    assert page["curves"] == 6 * [1]  # errors, cumulative and profile, of positions and rotations
    assert len(page["bands"]) == 1
    assert f"d = {result['unit']:.3g} " in page["conditions"]
    assert page["conditions"].endswith("left out" if options else "score 0")


@pytest.mark.parametrize("registration", ["refined", "pcr99"])
def test_cursors_say_the_scores_and_errors_of_the_run(saved, browse, examples, registration):
    evaluation = evaluate(*(examples / name for name in TUM[1:]), registration=registration)
    page = browse(saved(*TUM, "--registration", registration)[0])
    seeds = "mean over seeds 0 to 9" in page.evaluate(READ)["conditions"]
    assert seeds == (registration == "pcr99")
    frames, tas, ras = page.locator(".cursor").all()
    said = frames.locator("xpath=../../output")
    frames.press("Home")
    errors = evaluation.result.tas.errors, evaluation.result.ras.errors
    for index in (0, 10):
        values = ", ".join(
            f"{own[index]:.3g} {unit}" for own, unit in zip(errors, ("m", "deg"), strict=True)
        )
        assert said.inner_text() == f"{index / 10:.2f} s: estimate.txt {values}"
        assert frames.get_attribute("aria-valuetext") == said.inner_text()
        frames.press("PageUp")
    for cursor, score in ((tas, evaluation.result.tas.score), (ras, evaluation.ras)):
        for key in ("Home", "PageUp"):
            cursor.press(key)
        assert cursor.get_attribute("aria-valuetext").endswith(f": estimate.txt {score:.3f}")


def test_profiles_align_anew_at_each_largest_threshold(saved, browse, examples):
    """As `tas_profile` does; at ten times the largest threshold."""
    evaluation = evaluate(*(examples / name for name in TUM[1:]))
    cursor = browse(saved(*TUM)[0]).locator(".cursor").nth(1)
    cursor.press("End")
    poses = evaluation.matches.gt_poses, evaluation.matches.est_poses
    unit = evaluation.result.tas.unit
    profile = tas_profile(*(own[:, :3, 3] for own in poses), [unit, 10 * unit])
    assert cursor.get_attribute("aria-valuetext").endswith(f"{profile.scores[1]:.3f}")


def test_bands_show_outliers_and_lost_frames(saved, shown):
    page = shown(saved(*TUM, "--max_gap", 0)[0])
    assert set(page["bands"][0]) == {"tracked", "outlier", "lost"}


def test_an_outlier_far_away_does_not_flatten_the_other_errors(saved, examples, tmp_path):
    poses = np.loadtxt(examples / "tum/estimate.txt")
    poses[5, 1] = 1e9
    np.savetxt(tmp_path / "far.txt", poses, "%.6f")
    html, _ = saved("tum", examples / "tum/reference.txt", tmp_path / "far.txt")
    (path, *_) = re.findall(r'class="curve" [^>]* d="([^"]*L[^"]*)"', html)
    heights = np.array(
        [float(point.split()[1]) for point in re.split("[ML]", path.replace("h0", ""))[1:]]
    )
    assert heights.min() == 0
    assert np.ptp(heights[heights > 500]) > 100


def test_trajectories_rotate_and_mark_the_frame_that_is_pointed_at(saved, browse):
    page = browse(saved(*TUM)[0])
    scene, errors = page.locator("#scene"), page.locator(".cursor").first
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
    assert page["curves"] == 6 * [2]
    assert len(page["bands"]) == 2
    assert page["title"] == "estimate.txt, reference.txt against reference.txt"


def test_positions_alone_have_no_charts_of_rotations(saved, shown, examples, tmp_path):
    path = tmp_path / "positions.txt"
    np.savetxt(path, np.loadtxt(examples / "tum/estimate.txt")[:, :4], "%.6f")
    alone = shown(saved("tum", examples / "tum/reference.txt", path)[0])
    ((_, tas, *without),) = ([*row[:4], row[5], row[7]] for row in alone["table"])
    assert (float(tas) > 0, without) == (True, ["-"] * 4)
    both = shown(
        saved("tum", examples / "tum/reference.txt", examples / "tum/estimate.txt", path)[0]
    )
    assert (alone["curves"], both["curves"]) == ([1, 1, 1], [2, 1, 2, 1, 2, 1])
    assert both["table"][1][2] == "-" != both["table"][0][2]


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
    assert "://" not in html


def test_no_wider_than_the_screen(saved, browse):
    page = browse(saved(*TUM, TUM[1])[0])
    for width in (320, 390, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_the_cursor_follows_the_pointer(saved, browse):
    """Also over its own line."""
    page = browse(saved(*TUM)[0])
    cursor = page.locator(".cursor").first
    cursor.scroll_into_view_if_needed()
    box, seen = cursor.bounding_box(), []
    for step in range(20):
        page.mouse.move(box["x"] + box["width"] * (0.3 + 0.01 * step), box["y"] + 20)
        seen.append(int(cursor.get_attribute("aria-valuenow")))
    assert seen == sorted(seen)
    assert 0 < seen[0] < seen[-1]
