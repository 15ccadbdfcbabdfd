"""The page of a comparison: verdict, tables and drawings, all of it without a script."""

import re

import pytest
from bs4 import BeautifulSoup

YAML = """\
format: tum
reference: "{sequence}/gt.txt"
estimate: "{sequence}/{system}/{run}.txt"
runs: 3
systems:
  a&b: {runs: 4}
"""
SECTIONS = ["overall", "sequences", "differences", "runs", "errors"]


@pytest.fixture
def run(run_compare):
    return run_compare


@pytest.fixture
def page(run, tmp_path):
    """(arguments) -> the text of the page."""

    def page(*arguments):
        run(*arguments, "--html", "page.html")
        return (tmp_path / "page.html").read_text()

    return page


def test_the_page_is_whole_and_begins_with_the_verdict(patterns, page, tmp_path):
    for folder in tmp_path.glob("*/a_b"):
        folder.rename(folder.with_name("a&b"))
    (tmp_path / "b.yaml").write_text(YAML)
    text = page("b.yaml")
    soup = BeautifulSoup(text, "html.parser")
    ids = {element["id"] for element in soup.find_all(id=True)}
    assert {link["href"].removeprefix("#") for link in soup.find_all(href=True)} <= ids
    assert not soup.find_all(src=True)
    assert re.findall(r"<(?:title|h1)>(.*?)<", text) == 2 * [
        "a&amp;b and c are not distinguishable"
    ]
    assert "</h1><p>a&amp;b and c are not distinguishable: a&amp;b wins " in text
    assert re.findall(r'<section id="(\w+)"', text) == SECTIONS
    assert not soup.find_all(["script", "iframe"])
    assert "script-src" not in text
    assert "alignscores REF EST... --save_page FILE.html" in text
    assert str(tmp_path) not in text
    assert text == page("b.yaml", "--jobs", 1)


def section(text, name):
    return re.search(f'<section id="{name}".*?</section>', text, flags=re.S)[0]


def test_errors_over_time_have_gaps_and_a_band_a_run(benchmark_of, page, tmp_path):
    """It has no pose for 4 s, of which a second at each end is covered, and ends far off."""
    patterns = benchmark_of({"a": (0.01, 0.1, 1, 0.0)}, ["helix"], runs=2, n=120)
    for file in (tmp_path / "helix/a").iterdir():
        lines = file.read_text().splitlines()
        far = [line.split() for line in lines[110:]]
        ends = [" ".join([stamp, "1e3", *others]) for stamp, _, *others in far]
        file.write_text("\n".join([*lines[:40], *lines[80:110], *ends]))
    text = section(page(*patterns), "errors")
    kinds = re.findall(r'<rect [^>]*class="(tracked|outlier|lost)"', text)
    assert kinds == 2 * ["tracked", "lost", "tracked", "outlier"]
    ((x, width),) = re.findall(r'<rect x="(\d+)" width="(\d+)" [^>]*class="gap"', text)
    assert int(x) / 1000 == pytest.approx(50 / 120, abs=0.03)
    assert int(width) / 1000 == pytest.approx(20 / 120, abs=0.03)
    assert "<p>time [s]</p>" in text


def test_tables_and_drawings_are_no_wider_than_the_screen(patterns, page, tmp_path, browse):
    (tmp_path / "b.yaml").write_text(YAML)
    shown = browse(page("b.yaml"))
    for width in (1280, 390):
        shown.set_viewport_size({"width": width, "height": 900})
        assert shown.evaluate("document.documentElement.scrollWidth") <= width
        boxes = [one.bounding_box() for one in shown.locator("td:visible, svg:visible").all()]
        assert max(box["x"] + box["width"] for box in boxes) <= width
