"""The page shows all that it is made of, stands alone, and can be read by everybody."""

import re
from base64 import b64decode
from collections import Counter
from dataclasses import replace
from io import BytesIO
from itertools import pairwise
from types import SimpleNamespace

import pandas as pd
import pytest
from PIL import Image

import report.page
from alignscores.explorer import source
from studies.claims.claims import load_claims
from studies.paper import FIGURES
from studies.paper.table1 import CRITERIA, PAPER, PROPERTIES

from .conftest import TRIALS

CSS = source("style.css") + report.page.own("page.css")


def rows(page):
    return [element for element in page.all("tr") if element.get("id").startswith("claim-")]


def test_every_claim_stands_there_once_in_the_papers_order(page, table):
    found = rows(page)
    assert [row.get("id") for row in found] == [f"claim-{name}" for name in table["id"]]
    assert [row.get("data-verdict") for row in found] == list(table["verdict"])
    claims = load_claims().claims
    for row, name in zip(found, table["id"], strict=True):
        (header,) = page.within(row, "th")
        assert header.text.startswith(claims[name].statement)
        cells = list(page.within(row, "td"))
        assert cells[0].text.endswith(row.get("data-verdict"))
        assert cells[0].text[0] in "✓✗?"  # not by colour alone


def test_numbers_are_written_with_sign_and_unit(page, table):
    texts = dict(zip(table["id"], [row.text for row in rows(page)], strict=True))
    number = list(table["id"]).index("outliers-range-maa")
    ours = f"−{60 - number:.1f} % [−{60.125 - number:.1f}, −{59.875 - number:.1f}]"
    assert "−74 %" in texts["outliers-range-maa"]
    assert ours in texts["outliers-range-maa"]
    assert "below 0 points" in texts["outliers-tas-steadier"]
    assert "below 50 %" in texts["length-tas-much-below-dte"]
    assert "0.300 τ [0.175, 0.425]" in texts["outliers-ate-discerns"]
    assert "+0.320 τ" in texts["outliers-dte-degrades-slower"]
    assert "-" not in re.sub(r"[A-Za-z]-\w", "", "".join(texts.values()))  # a true minus


def test_the_answer_counts_verdicts_replicates_and_trials(page, table):
    (answer,) = [p for p in page.all("p") if p.get("class") == "answer"]
    counted = table[table["implied_by"].isna()]
    counts = Counter(counted["verdict"])
    assert answer.text == (
        f"Of the {len(counted)} claims checked, {counts['reproduced']} are reproduced, "
        f"{counts['not reproduced']} are not reproduced and {counts['inconclusive']} are "
        "inconclusive, judged from 3 replicate studies of 7 trials in each cell."
    )
    true = Counter(counted["population"])
    (second,) = [p for p in page.all("p") if p.text.startswith("Reproduced is what one study")]
    assert f"{true['true']} are true, {true['false']} false and {true['open']} open" in second.text
    assert f"{len(table) - len(counted)} more claims follow" in second.text
    assert any("A quick look: the paper has 50 trials" in p.text for p in page.all("p"))


def test_one_exception_is_named_beneath_the_answer(results, monkeypatch):
    with results.table("claims.csv") as frame:
        frame["verdict"] = "reproduced"
        frame.loc[4, "verdict"] = "not reproduced"
    monkeypatch.setattr(report.page, "PAPER_TRIALS", TRIALS)
    page = results.page()
    (header,) = page.all("header")
    assert "1 is not reproduced and 0 are inconclusive" in header.text
    (item,) = [li for li in page.within(header, "li") if "reproduced" in li.text]
    (link,) = page.within(item, "a")
    assert link.get("href") == rows(page)[4].get("id").join(("#", ""))
    assert "A quick look" not in header.text


def test_statements_are_escaped(results, monkeypatch):
    claims = load_claims()
    name, claim = next(iter(claims.claims.items()))
    text = 'a <b>bold</b> & "quoted" claim </script>'
    changed = {**claims.claims, name: replace(claim, statement=text)}
    claims = replace(load_claims(3), claims=changed)
    monkeypatch.setattr(report.page, "load_claims", lambda _: claims)
    with results.table("claims.csv") as frame:
        frame.loc[0, "statement"] = text
    page = results.page()
    assert page.html.count("<b>bold") == 0
    assert text in rows(page)[0].text


def test_names_are_escaped():
    template = report.page.environment().from_string("{{ name }}")
    assert template.render(name="<script>") == "&lt;script&gt;"


def test_what_chance_brings_is_told(page, table):
    """Of three replicates the central 95 % hold less than half of all studies."""
    numbers = table["paper"].notna().sum()
    said = " ".join(dd.text for dd in page.all("dd"))
    assert "central 95 %: the spread that a single study has" in said
    assert f"{numbers} claims are numbers" in said
    assert f"5 % of them, about {0.05 * numbers:.1f}, would be expected outside" in said
    assert "a new study’s statistic with a probability of 48 %" in said


def test_it_needs_no_other_file_and_every_link_leads_somewhere(page):
    assert page.html.endswith("</html>\n")
    assert not page.all("link", "iframe", "object", "base", "form")
    assert page.html.count("url(") == 0
    assert page.html.count("@import") == 0
    ids = [element.get("id") for element in page.elements if element.get("id")]
    assert len(ids) == len(set(ids))
    for element in page.elements:
        assert element.get("src").startswith("data:image/png;base64,") or not element.get("src")
        assert element.tag == "a" or not element.get("href")
    for link in page.all("a"):
        href = link.get("href")
        assert href.startswith("https://") or href.removeprefix("#") in ids, href
    for element in page.elements:
        for name in element.get("aria-labelledby").split():
            assert name in ids


def test_it_can_be_read_without_seeing_it(page):
    levels = [int(heading.tag[1]) for heading in page.all("h1", "h2", "h3", "h4")]
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    assert all(len(image.get("alt")) > 80 for image in page.all("img"))
    assert all(svg.get("aria-hidden") == "true" for svg in page.all("svg"))
    for table in page.all("table"):
        assert len(list(page.within(table, "caption"))) == 1
    assert all(th.get("scope") in ("row", "col", "rowgroup") for th in page.all("th"))
    for tag in ("header", "main", "footer", "nav"):
        assert len(page.all(tag)) == 1
    skip = page.all("a")[0]
    assert skip.get("href") == "#claims"
    assert page.all("html")[0].get("lang") == "en"


def test_controls_are_hidden_where_no_script_shows_them(page):
    assert "hidden" in page.id("controls").attributes
    outside = [b for b in page.all("button", "select") if page.id("controls") not in b.parents]
    assert outside == []


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_has_its_claims(page, table, name):
    section = page.id(f"figure-{name}")
    links = [a.get("href").removeprefix("#claim-") for a in page.within(section, "a")]
    assert links == [claim.id for claim in load_claims().claims.values() if claim.figure == name]
    assert len(list(page.within(section, "img"))) == 1
    assert section.text.startswith(f"Figure {list(FIGURES).index(name) + 1} ")


def test_texts_follow_the_numbers(results, page):
    with results.table("claims.csv") as frame:
        row = frame["id"] == "outliers-range-maa"
        frame.loc[row, ["ours", "low", "high"]] = [12.345, 11.0, 13.0]
    sentence = "from 0 to 50 outliers that of the mAA changes by +12.3 % (paper: −74 %)"
    assert sentence in results.page().id("figure-outliers").text
    assert sentence not in page.id("figure-outliers").text
    assert "and 0.310 with 1 outlier;" in page.id("figure-outliers").text


def test_an_undefined_statistic_is_called_so(results):
    with results.table("claims.csv") as frame:
        frame.loc[0, "verdict"] = "inconclusive"
        frame.loc[0, ["ours", "low", "high"]] = None
    page = results.page()
    row = rows(page)[0]
    assert "undefined" in row.text
    assert list(page.within(row, "svg")) == []
    assert "nan" not in page.html.partition("<main>")[2].partition("data:image")[0]


def test_cells_that_disagree_with_table_1_are_marked(page):
    section = page.id("comparison")
    cells = [cell for cell in page.within(section, "td") if cell.get("data-label")]
    marked = [cell for cell in cells if cell.get("class") == "disagrees"]
    assert len(cells) == 28
    assert len(marked) == 6  # those where the paper says no
    assert all("yes paper: no" in cell.text for cell in marked)
    assert [c.text for c in cells if c.get("class") == "untested"] == ["not tested paper: yes"]
    assert "11 of the 16 cells" in section.text


def test_decisions_tell_what_each_reading_changes(page):
    section = page.id("decision-range")
    changed = load_claims().under(decision("range"), decision("range").readings[1])
    n = len(changed)
    assert f"“mean curve” concerns {n} claims and changes {n} verdicts." in section.text
    assert len(list(page.within(section, "td"))) == n * 3
    sentence = "“first axis” concerns 1 claim and changes 1 verdict."
    assert sentence in page.id("decision-direction").text


def decision(name):
    return next(decision for decision in load_claims().decisions if decision.id == name)


def test_readings_that_change_no_verdict(results):
    with results.table("tables/readings.csv") as frame:
        frame["verdict"] = "reproduced"
    page = results.page()
    assert "“first axis” concerns 1 claim and changes no verdicts." in page.html
    assert list(page.within(page.id("decision-direction"), "table")) == []


def test_the_matrix_has_both_verdicts_of_every_claim_under_every_reading(page):
    claims = load_claims()
    (table,) = [table for table in page.all("table") if "readings" in table.get("class").split()]
    bodies = [page.cells(row) for row in page.within(table, "tr")][1:]
    readings = list(claims.read())
    assert [len(cells) for cells in bodies] == [1 + len(readings)] * len(claims.claims)
    for name, cells in zip(claims.claims, bodies, strict=True):
        assert cells[0].split() in (["✓", "T"], ["✗", "F"], ["?", "O"])
        expected = ["? O" if name in changed else "" for *_, changed in readings]
        assert cells[1:] == expected


def test_metrics_are_ranked_and_criteria_varied(page):
    section = page.id("head_to_head").text
    assert "mAA 90.0 > TAS 80.0" in section
    assert "mAA 9, TAS ∞" in section
    assert "5 of 16" in page.id("comparison").text


def test_pictures_are_numbered_and_have_their_claims():
    """Those of more than 1500 pixels are wide."""
    figures = {
        name: Image.new("RGBA", (width, 3), "red") for name, width in (("a", 1500), ("b", 1501))
    }
    claims = [SimpleNamespace(claim=SimpleNamespace(figure=name)) for name in ("b", "a", None, "b")]
    pictures = report.page._pictures(figures, claims)
    for picture in pictures.values():
        start, data = picture.pop("source").split(",")
        assert start == "data:image/png;base64"
        with Image.open(BytesIO(b64decode(data))) as image:
            assert image.size == (picture["width"], 3)
            assert image.convert("RGB").getpixel((0, 0)) == (255, 0, 0)
    assert pictures == {
        "a": {"number": 1, "width": 1500, "height": 3, "is_wide": False, "rows": claims[1:2]},
        "b": {"number": 2, "width": 1501, "height": 3, "is_wide": True, "rows": claims[::3]},
    }


def test_pictures_are_compressed_as_far_as_they_can_be():
    image = Image.effect_mandelbrot((200, 200), (-2.0, -1.5, 1.0, 1.5), 50)
    (picture,) = report.page._pictures({"a": image}, []).values()
    sizes = []
    for level in (6, 9):  # the usual one, and the best
        image.convert("RGB").quantize(256).save(buffer := BytesIO(), "PNG", compress_level=level)
        sizes.append(len(buffer.getvalue()))
    usual, best = sizes
    assert len(b64decode(picture["source"].partition(",")[2])) <= best < usual


def row(name, verdict, population, **more):
    """Return what is counted of an estimate."""
    own = {"source": "Figure 2", "paper": None, "implied_by": [], **more}
    outside = own.pop("is_outside", False)
    claim = SimpleNamespace(id=name, **own)
    return SimpleNamespace(claim=claim, verdict=verdict, population=population, is_outside=outside)


def test_verdicts_are_counted_but_for_those_that_follow_from_others():
    """Of 39 replicates the outermost are at 1.95/40 on either side."""
    a = row("a", "reproduced", "true", paper=-74.0, is_outside=True)
    b = row("b", "inconclusive", "open", paper=3.0, source="Section 6")
    c = row("c", "not reproduced", "false", is_outside=True)
    d = row("d", "not reproduced", "open", paper=1.0, is_outside=True, implied_by=["a"])
    e = row("e", "reproduced", "open")
    rows = [a, b, c, d, e]
    found = report.page._verdicts(rows, 39)
    assert found.pop("missed") == pytest.approx(0.0975)
    assert found.pop("central") == pytest.approx(0.95)
    order = {key: [*found[key].items()] for key in ("counts", "populations")}
    assert order == {
        "counts": [("reproduced", 2), ("inconclusive", 1), ("not reproduced", 1)],
        "populations": [("true", 1), ("open", 2), ("false", 1)],
    }
    assert found == {
        "counted": [a, b, c, e],
        **{key: dict(pairs) for key, pairs in order.items()},
        "population_words": ("false", "open", "true"),
        "shown": {"reproduced": 2, "inconclusive": 1, "not reproduced": 2},
        "rows": rows,
        "claims": {"a": a, "b": b, "c": c, "d": d, "e": e},
        "verdicts": ("not reproduced", "inconclusive", "reproduced"),
        "sources": ["Figure 2", "Section 6"],
        "exceptions": [c, b],
        "n_numbers": 3,
        "n_outside": 2,
    }


def test_a_decision_has_the_estimates_under_each_reading():
    """None where a reading does not concern a claim; a claim that none concerns has no row."""
    words = {"a": "reproduced", "b": "not reproduced", "c": "reproduced"}
    taken = {name: row(name, verdict, "open") for name, verdict in words.items()}
    first = {"a": row("a", "reproduced", "open")}
    second = {"a": row("a", "inconclusive", "open"), "b": row("b", "not reproduced", "true")}
    decision = SimpleNamespace(readings=["taken", "first", "second"])
    of_a = [taken["a"], first["a"], second["a"]]
    assert report.page._evidence(decision, taken, [first, second]) == {
        "decision": decision,
        "rows": {"a": of_a, "b": [taken["b"], None, second["b"]]},
        "others": ["first", "second"],
        "tallies": [("first", 1, 0), ("second", 2, 1)],
        "dependent": {"a": of_a},
    }


def test_table_1_is_in_the_paper_s_order(original):
    table = pd.read_csv(original.folder / "tables/method_comparison.csv", dtype={"value": str})
    found = report.page._table1(table)
    assert [metric for metric, _ in found["table1"]] == list(PAPER)
    for _, cells in found["table1"]:
        assert list(cells["property"]) == list(PROPERTIES)
        assert list(cells["value"][:3]) == [0.25] * 3
    assert list(found["statistics"].items()) == [(name, "tau") for name in PROPERTIES]
    assert list(found["criteria"]) == list(PROPERTIES)
    assert list(found["criteria"].values()) == list(CRITERIA)
    assert (found["n_agreeing"], found["n_tested"]) == (11, 16)
    assert set(found["figure_of"].values()) <= set(FIGURES)


def test_templates_leave_no_empty_lines_where_their_blocks_were():
    text = "<p>\n  {% if true %}\na\n  {% endif %}\n</p>\n"
    assert report.page.environment().from_string(text).render() == "<p>\na\n</p>\n"


def test_the_page_has_its_looks_and_its_scripts_and_may_show_pictures(page):
    for part in ("style.css", "tables.js"):
        assert source(part) in page.html
    for part in ("page.css", "page.js"):
        assert report.page.own(part) in page.html
    (policy,) = [meta.get("content") for meta in page.all("meta") if meta.get("http-equiv")]
    assert policy.endswith("script-src 'unsafe-inline'; img-src data:")
    (title,) = page.all("title")
    assert title.text == "Which claims hold: alignment scores, repeated"


def luminance(colour):
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(colour, other):
    dark, light = sorted(map(luminance, (colour, other)))
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("scheme", [0, 1], ids=["light", "dark"])
def test_text_has_contrast_in_both_schemes(scheme):
    blocks = re.findall(r":root \{(.*?)\}", CSS, re.DOTALL)
    assert len(blocks) == 4  # of the library's pages, and of this one
    colour = dict(re.findall(r"--([\w-]+): (#\w{6});", blocks[scheme] + blocks[2 + scheme]))
    assert len(colour) == 12
    on = {
        "paper": ("ink", "quiet", "link", "good", "bad", "open"),
        "panel": ("ink", "quiet", "link", "good", "bad", "open"),
        "good-tint": ("good",),
        "bad-tint": ("bad", "ink", "quiet"),
        "open-tint": ("open",),
        "ink": ("paper",),
    }
    ratios = {
        (text, ground): contrast(colour[text], colour[ground])
        for ground, texts in on.items()
        for text in texts
    }
    assert min(ratios.values()) >= 4.5, ratios
    assert contrast("#ffffff", "#000000") == pytest.approx(21)
