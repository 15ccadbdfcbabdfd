"""The page shows all that it is made of, stands alone, and can be read by everybody."""

import re
from collections import Counter
from itertools import pairwise

import pytest

from alignscores.explorer import source
from report.page import own
from studies.claims.claims import load_claims
from studies.paper import FIGURES

CSS = source("style.css") + own("page.css")


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


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_has_its_claims(page, table, name):
    section = page.id(f"figure-{name}")
    links = [a.get("href").removeprefix("#claim-") for a in page.within(section, "a")]
    assert links == [claim.id for claim in load_claims().claims.values() if claim.figure == name]
    assert len(list(page.within(section, "img"))) == 1
    assert section.text.startswith(f"Figure {list(FIGURES).index(name) + 1} ")


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


def test_decisions_show_the_claims_that_depend_on_the_reading(page):
    changed = load_claims().under(decision("range"), decision("range").readings[1])
    assert len(list(page.within(page.id("decision-range"), "td"))) == len(changed) * 3


def decision(name):
    return next(decision for decision in load_claims().decisions if decision.id == name)


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
    colour = dict(re.findall(r"--([\w-]+): (#\w{6});", blocks[scheme] + blocks[2 + scheme]))
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
