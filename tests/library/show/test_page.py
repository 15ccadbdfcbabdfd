"""The page of estimates in a browser: it draws, asks for nothing, and has the command's numbers."""

import dataclasses
import json
import os
import re
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest

from alignscores import evaluate, save_page, tas_profile
from tests.files import FILES, TUM

READ = """() => {
  const all = (selector) => [...document.querySelectorAll(selector)];
  return {
    tables: all("table").map((t) => [...t.rows].map((r) => [...r.cells].map((c) => c.textContent))),
    title: document.querySelector("h1").textContent,
    lead: all("header p").map((line) => line.textContent),
    notes: all("li").map((line) => line.textContent),
  };
}"""


@pytest.fixture
def saved(run, tmp_path):
    """(arguments) -> the page, and the JSON output of the same run."""

    def saved(*arguments):
        path = tmp_path / "page.html"
        code, out, _ = run(*arguments, "--save_page", path, "--json")
        assert code == 0
        return path.read_text("utf-8"), json.loads(out)

    return saved


@pytest.fixture
def estimates(tmp_path, examples):
    """Two estimates: one with an outlier, and one without its second half."""
    lines = (examples / TUM[2]).read_text().splitlines()
    rows = [line.split() for line in lines if not line.startswith("#")]
    rows[5][1] = "1e9"
    for name, content in (("far.txt", rows), ("half.txt", rows[:20])):
        (tmp_path / name).write_text("\n".join(map(" ".join, content)))
    return tmp_path / "far.txt", tmp_path / "half.txt"


@pytest.mark.timeout(300)
def test_the_page_draws_and_answers(saved, opened, estimates, run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    arguments = *TUM[:2], *estimates, "--max_gap", 0.2
    html, printed = saved(*arguments)
    page = opened(html)
    shown = page.evaluate(READ)
    out = run(*arguments)[1]
    lines = [re.split("  +", line) for line in out.splitlines()]
    assert shown["tables"][0] == lines[:3]
    assert shown["lead"] == out.splitlines()[3:]
    full = run(*arguments, "-v")[2]
    assert shown["notes"] == [
        line.removeprefix("alignscores: note: ") for line in full.splitlines()
    ]
    header, *costs = shown["tables"][1]
    n_costs = sum(len(result["deficits"]) for result in printed["results"])
    assert (header[1], len(costs)) == ("score", n_costs)

    trajectories, errors, scores = page.locator(".js-plotly-plot").all()
    # 3D is drawn, and rotates.
    seen = trajectories.evaluate("plot => plot._fullLayout.scene._scene.getCamera().eye")
    trajectories.scroll_into_view_if_needed()
    box = trajectories.bounding_box()
    centre = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(*centre)
    page.mouse.down()
    page.mouse.move(centre[0] + 150, centre[1] + 20, steps=4)
    page.mouse.up()
    turned = "plot => plot._fullLayout.scene._scene.getCamera().eye"
    assert trajectories.evaluate(turned) != seen
    pixels = trajectories.evaluate("plot => Plotly.toImage(plot, {format: 'png', width: 400})")
    assert len(pixels) > 5_000
    # A click on a name hides it, what is lost of it, too.
    visible = "plot => plot._fullData.filter(t => t.name == 'half.txt').map(t => t.visible)"
    assert set(errors.evaluate(visible)) == {True}
    errors.locator(".legendtoggle").nth(1).click()
    page.wait_for_timeout(600)
    assert set(errors.evaluate(visible)) == {"legendonly"}
    # The pointer reads time and error.
    area = errors.locator(".nsewdrag").nth(1)
    area.scroll_into_view_if_needed()
    plot = area.bounding_box()
    page.mouse.move(plot["x"] + plot["width"] / 4, plot["y"] + plot["height"] / 2)
    page.wait_for_timeout(300)
    hover = errors.locator(".hoverlayer").text_content()
    assert re.search(r"\d\.\d\d s.*far\.txt : [\d.e+-]+ m", hover), hover

    # No labels of a logarithmic axis overlap, also where it has little more than a decade.
    for decades in (0.4, 1.1, 2.5, 6):
        errors.evaluate(f"plot => Plotly.relayout(plot, {{'yaxis2.range': [-2, {decades - 2}]}})")
        boxes = [label.bounding_box() for label in errors.locator(".y2tick").all()]
        assert len(boxes) > 1
        for upper, lower in pairwise(sorted(boxes, key=lambda box: box["y"])):
            assert upper["y"] + upper["height"] <= lower["y"] + 3

    for width in (390, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_timeout(1500)  # charts are drawn anew
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    lost = errors.evaluate("plot => plot.data.filter(t => t.fill == 'toself').length")
    assert lost >= 2  # of positions and rotations
    x = scores.evaluate("plot => [...plot.calcdata[0].map(point => [point.x, point.y])]")
    assert len(x) == 16


def test_profiles_align_anew_at_each_largest_threshold(examples):
    """As `tas_profile` does."""
    from alignscores.show.page import figures

    evaluation = evaluate(*(examples / name for name in TUM[1:]))
    figure = figures([evaluation])["profiles"]
    poses = evaluation.matches.gt_poses, evaluation.matches.est_poses
    profile = tas_profile(
        *(trajectory[:, :3, 3] for trajectory in poses), np.array(figure.data[0].x)
    )
    np.testing.assert_allclose(figure.data[0].y, profile.scores, atol=1e-12)


def test_positions_alone_have_no_charts_of_rotations(examples, tmp_path):
    from alignscores.show.page import figures

    path = tmp_path / "positions.txt"
    np.savetxt(path, np.loadtxt(examples / "tum/estimate.txt")[:, :4], "%.6f")
    single = evaluate(examples / TUM[1], path)
    both = evaluate(examples / TUM[1], examples / TUM[2])
    for scored, n in (([single], 1), ([both], 2), ([single, both], 2)):
        drawn = figures(scored)
        assert len([*drawn["profiles"].select_xaxes()]) == n
        assert len([*drawn["errors"].select_xaxes()]) == 2 * n


HOSTILE = [
    "<script>alert(1)</script>",
    "<b>bold</b>&amp;<img src=http://a.b/x.png onerror=alert(1)>",
    "'\"</script><script>document.title='gone'</script>",
    "a\nb\r\x1b[31mred\x07",
    "%{x}{{ 7 * 7 }}{% raw %}$a_b$",
]


@pytest.mark.timeout(300)
def test_names_are_text(opened, examples, tmp_path):
    evaluation = evaluate(*(examples / name for name in FILES["nerf"]))
    evaluations = [dataclasses.replace(evaluation, name=name) for name in HOSTILE]
    save_page(evaluations, tmp_path / "page.html")
    page = opened((tmp_path / "page.html").read_text("utf-8"))
    plain = [name.encode("unicode_escape").decode().replace("\\\\", "\\") for name in HOSTILE]
    shown = page.evaluate(READ)
    assert [row[0] for row in shown["tables"][0][1:]] == plain
    assert shown["title"].startswith(f"{plain[0]}, {plain[1]}, ")
    names = page.locator(".js-plotly-plot").nth(1).locator(".legendtext").all_text_contents()
    assert names == plain
    assert page.locator("b, img[src^=http]").count() == 0
    assert page.title() == shown["title"]


@pytest.mark.skipif(os.name == "nt", reason="its files cannot have these names")
def test_paths_stay_private(saved, examples, tmp_path):
    names = "<i>é.json", "<script><b>é\"&'.json"
    for name, file in zip(names, FILES["nerf"], strict=True):
        (tmp_path / name).write_text((examples / file).read_text())
    html, _ = saved("nerf", *(tmp_path / name for name in names))
    assert str(tmp_path) not in html


def test_what_is_missing_is_named(tmp_path, examples):
    """The table needs no plotly."""
    files = str(examples / TUM[1]), str(examples / TUM[2])
    code = (
        "import sys; sys.modules['plotly'] = None; from alignscores.cli import main\n"
        f"print(main({files}), main({(*files, '--save_page', str(tmp_path / 'page.html'))}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.startswith("estimate ")
    assert done.stdout.splitlines()[-1] == "0 1"
    assert done.stderr.count('pip install "alignscores[page]"') == 1
    assert "Traceback" not in done.stderr
