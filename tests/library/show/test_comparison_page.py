"""The page of a comparison: verdict, all notes, tables and drawings, in a browser."""

import re

import numpy as np
import pandas as pd
import pytest
from bs4 import BeautifulSoup

from alignscores import compare, plot, save_page
from alignscores.show.comparison_page import figures_of_comparison, page_of_comparison

HOSTILE = "<script>alert(1)</script>", "a\n\x1b[31m\"b'&amp;", "$x$ %{y} {{ 7 * 7 }}"


@pytest.fixture
def run(run_compare):
    return run_compare


def texts_of(html):
    """Return headings, paragraphs and notes of a page, with blanks for the ends of lines."""
    soup = BeautifulSoup(html, "html.parser")
    return {
        name: [" ".join(tag.get_text().split()) for tag in soup.select(selector)]
        for name, selector in {
            "headings": "h2",
            "lead": "header p",
            "notes": "li",
            "cells": "th, td",
        }.items()
    }


def test_page_and_markdown_have_every_note_that_the_command_prints(benchmark_of, run, tmp_path):
    """Notes on files, why scores are low, why runs failed, what was left out, and the gate."""
    patterns = benchmark_of({"a": (0.5, 10.0, 1, 0.5), "c": (0.3, 3.0, 1, 0.0)})
    (tmp_path / "car/c/0.txt").write_text("1 2\n")
    (tmp_path / "helix/gt.txt").unlink()
    saved = "--save_page", "page.html", "--markdown", "report.md"
    code, out, err = run(*patterns, *saved, "--fail_on", "failed>0", "-v")
    assert code == 3
    printed = " ".join(out.split())
    notes = re.findall(r"note: .*?(?= note: | system +rank )", printed)
    errors = [line.removeprefix("alignscores: ") for line in err.splitlines()]
    assert notes
    assert len(errors) >= 3
    page = texts_of((tmp_path / "page.html").read_text())
    expected = [note.removeprefix("note: ") for note in notes] + errors
    assert page["notes"][: len(expected)] == expected
    assert page["headings"][0] == "Notes"
    assert all(line in printed for line in page["lead"])
    markdown = " ".join((tmp_path / "report.md").read_text().replace("\\", "").split())
    for line in expected:
        fails = f"**Fails:** {line.removeprefix('error: ')}"
        assert f"- {line}" in markdown or fails in markdown


def test_it_has_the_tables_of_the_command(patterns, run, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")
    out = run(*patterns, "--save_page", "page.html")[1]
    page = texts_of((tmp_path / "page.html").read_text())
    rows = [
        re.split("  +", line) for line in out.splitlines() if re.match("(system|a_b|c)  ", line)
    ]
    for row in rows:
        assert set(row) <= set(page["cells"])
    assert "coverage" in page["cells"]
    comparison = compare(*patterns[1:], format=patterns[0])
    save_page(comparison, tmp_path / "again.html")
    again = (tmp_path / "again.html").read_text()
    assert again == (tmp_path / "page.html").read_text() == page_of_comparison(comparison)
    assert str(tmp_path) not in again


def test_what_changed_stands_on_the_page(patterns, run, tmp_path):
    run(*patterns, "--save_csv", "saved.csv")
    run(*patterns, "--baseline", "saved.csv", "--save_page", "page.html")
    assert "PAS against saved.csv" in texts_of((tmp_path / "page.html").read_text())["headings"]


def test_errors_over_time_have_gaps_where_most_runs_are_lost(benchmark_of, tmp_path):
    """It has no pose for 4 s; a second at each end is covered."""
    _, *patterns = benchmark_of({"a": (0.01, 0.1, 1, 0.0)}, ["helix"], runs=2, n=120)
    for file in (tmp_path / "helix/a").iterdir():
        lines = file.read_text().splitlines()
        file.write_text("\n".join([*lines[:40], *lines[80:]]))
    comparison = compare(*(str(tmp_path / pattern) for pattern in patterns))
    (shade,) = [trace for trace in figures_of_comparison(comparison)["errors"].data if trace.fill]
    assert np.nanmin(shade.x) == pytest.approx(5, abs=0.3)
    assert np.nanmax(shade.x) == pytest.approx(7, abs=0.3)


@pytest.fixture
def tested():
    """Three systems with hostile names in one table; one is ahead."""
    rng = np.random.default_rng(0)
    rows = [
        {
            "system": name,
            "sequence": sequence,
            "run": k,
            "PAS": rng.uniform(0.4, 0.5) + 0.3 * (not i),
        }
        for i, name in enumerate(HOSTILE)
        for sequence in ("room", "hall & <i>")
        for k in range(6)
    ]
    rows[-1]["PAS"] = np.nan
    return compare(pd.DataFrame(rows), by="PAS")


def test_differences_have_intervals_dashed_where_they_are_not_significant(tested):
    pairs = tested.pairs[tested.pairs["sequence"].isna()].set_index(["a", "b"])
    figure = figures_of_comparison(tested)["differences"]
    ends_ahead, ahead, ends_of_others, others = figure.data
    is_ahead = pairs["better"].notna()
    for chosen, marks, ends, dash in (
        (pairs[is_ahead], ahead, ends_ahead, None),
        (pairs[~is_ahead], others, ends_of_others, "dash"),
    ):
        assert len(marks.x) == (1 if dash else 2)
        np.testing.assert_allclose(marks.x, chosen["difference"])
        x = np.float64(ends.x).reshape(-1, 3)[:, :2]
        np.testing.assert_allclose(x, chosen[["low", "high"]])
        assert ends.line.dash == dash
    axes = {axis.get_xlabel(): axis for axis in plot(tested).axes}["difference in PAS"]
    drawn = [line.get_xdata()[0] for line in axes.get_lines() if line.get_marker() == "o"]
    np.testing.assert_allclose(drawn, [*ahead.x, *others.x])
    (right,) = axes.child_axes
    for texts in (figure.layout.yaxis.ticktext, [t.get_text() for t in right.get_yticklabels()]):
        assert sum("wins 100%, adjusted p < 0.001" in text for text in texts) == 2
    for options in ({"kind": "errors"}, {"plot_mode": "xy"}):
        with pytest.raises(ValueError, match="apply only to estimates"):
            plot(tested, **options)


def test_labels_of_a_difference_name_p_and_a_mean_that_differs_the_other_way():
    """Of a single pair nothing is adjusted."""
    runs = pd.DataFrame({"system": 10 * ["a"] + 10 * ["b"], "PAS": [*9 * [0.9], 0, *10 * [0.85]]})
    comparison = compare(runs, by="PAS")
    (label,) = figures_of_comparison(comparison)["differences"].layout.yaxis.ticktext
    assert re.search(r">wins 90%, p = 0\.0\d+<br>though its mean is worse<", label)
    (right,) = {axis.get_xlabel(): axis for axis in plot(comparison).axes}[
        "difference in PAS"
    ].child_axes
    (text,) = (text.get_text() for text in right.get_yticklabels())
    assert re.fullmatch(r"wins 90%, p = 0\.0\d+, though its mean is worse", text)


@pytest.mark.timeout(300)
def test_in_a_browser_it_answers_and_names_are_text(opened, tested):
    page = opened(page_of_comparison(tested))
    plain = [name.encode("unicode_escape").decode().replace("\\'", "'") for name in HOSTILE]
    assert page.title() == f"PAS of {', '.join(tested.overall['system'])}"
    assert all(name in page.title() for name in plain)
    differences, runs = page.locator(".js-plotly-plot").all()
    assert set(runs.locator(".legendtext").all_text_contents()) == set(plain)
    assert page.locator("section i, section b i").count() == 0
    # No label lies across the line at zero: they end before the axes begin.
    box = differences.locator(".nsewdrag").first.bounding_box()
    for label in differences.locator(".ytick").all():
        label_box = label.bounding_box()
        assert label_box["x"] + label_box["width"] <= box["x"] + 1
    # A click on a name hides its runs, their mean, and those that failed.
    visible = "plot => plot._fullData.filter(t => t.legendgroup == '0').map(t => t.visible)"
    assert set(runs.evaluate(visible)) == {True}
    runs.locator(".legendtoggle").first.click()
    page.wait_for_timeout(600)
    assert set(runs.evaluate(visible)) == {"legendonly"}
    # The pointer reads run and value.
    mark = runs.locator(".scatterlayer .trace .points path").last.bounding_box()
    page.mouse.move(mark["x"] + mark["width"] / 2, mark["y"] + mark["height"] / 2)
    page.wait_for_timeout(300)
    assert re.search(r"(run|mean).*: ", runs.locator(".hoverlayer").text_content())
    for width in (390, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        page.wait_for_timeout(1000)  # charts are drawn anew
        assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(("n", "title"), [(4, "s of a, b, c, d"), (5, "s of a, b, c and 2 more")])
def test_its_title_names_the_systems(n, title):
    runs = pd.DataFrame({"system": 3 * list("abcde")[:n]}).assign(s=range(3 * n))
    html = page_of_comparison(compare(runs, by="s", better="smaller"))
    assert BeautifulSoup(html, "html.parser").title.get_text() == title
