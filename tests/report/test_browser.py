"""The page in a browser: sorting, filtering, links, and nothing wider than a phone."""

import re
from collections import Counter

import pytest

from studies.claims.claims import load_claims
from studies.claims.verdicts import TRUTHS

# Presses what a reader would press, and tells what then stands there.
DRIVER = """
const rows = () => [...document.querySelectorAll("#claims-table tbody tr")];
const ids = () => rows().map((row) => row.id.slice("claim-".length));
const visible = () =>
  rows().filter((row) => row.offsetHeight > 0).map((row) => row.dataset.verdict);
const headers = [...document.querySelectorAll("#claims-table thead th")];
const sorts = () => headers.map((header) => header.getAttribute("aria-sort"));
const pressed = () => [...document.querySelectorAll("#controls button")]
  .filter((button) => button.getAttribute("aria-pressed") === "true")
  .map((button) => button.dataset.verdict);
const said = () => document.getElementById("shown").textContent;
const controls = document.getElementById("controls").offsetHeight;
const outcome = { controls, sorted: [], filtered: {} };
for (const header of headers) {
  const button = header.querySelector("button");
  const states = [];
  for (let press = 0; press < 3; press++) {
    button.click();
    states.push({ ids: ids(), sorts: sorts(), said: said() });
  }
  outcome.sorted.push(states);
}
for (const button of document.querySelectorAll("#controls button")) {
  button.click();
  const state = { visible: visible(), pressed: pressed(), said: said() };
  outcome.filtered[button.dataset.verdict] = state;
}
const source = document.getElementById("source");
source.value = "Figure 3";
source.dispatchEvent(new Event("change"));
document.querySelector('#controls button[data-verdict="inconclusive"]').click();
outcome.both = { visible: visible(), said: said() };
const linked = document.querySelector("#figure-outliers a");
outcome.linked = { before: document.querySelector(linked.getAttribute("href")).hidden };
linked.click();
setTimeout(() => {
  const row = document.querySelector(linked.getAttribute("href"));
  outcome.linked.after = row.hidden;
  outcome.linked.top = row.getBoundingClientRect().top;
  outcome.linked.said = said();
  tell(outcome);
}, 100);
"""
WIDTHS = """
const root = document.documentElement;
const details = [...document.querySelectorAll("details")];
details.forEach((each) => { each.open = true; });
tell({
  scroll: root.scrollWidth,
  inner: innerWidth,
  controls: document.getElementById("controls").offsetHeight,
  details: details.length,
});
"""
# Tells which of the details can be seen; all of them are closed.
CLOSED = """
const tables = [...document.querySelectorAll("details:not([open]) table")];
tell(tables.map((table) => table.checkVisibility()));
"""


@pytest.fixture(scope="module")
def outcome(page, browser):
    return browser.run(page.html, DRIVER)


def keys(page, column):
    """What a column has to be sorted by, from the cells' texts."""
    found: dict[str, list[float] | None] = {}
    units = ("%", "points", "τ")
    for row in page.all("tr"):
        if row.get("id").startswith("claim-"):
            text = list(page.within(row, "th", "td"))[column].text.replace("−", "-")
            number = re.match(r"([+-]?[\d.]+)\s(%|points|τ)", text)
            name = row.get("id").removeprefix("claim-")
            found[name] = [units.index(number[2]), float(number[1])] if number else None
            if (word := text.split()[0]) in TRUTHS:
                found[name] = [float(TRUTHS.index(word))]
    return found


def test_every_column_sorts_up_down_and_back(outcome, page, table):
    order = list(table["id"])
    assert outcome["controls"] > 0
    assert len(outcome["sorted"]) == 6
    for column, states in enumerate(outcome["sorted"]):
        for state, direction in zip(states, ("ascending", "descending", "none"), strict=True):
            expected = ["none"] * 6
            expected[column] = direction
            assert state["sorts"] == expected
            assert sorted(state["ids"]) == sorted(order)
            assert state["said"].startswith(f"{len(order)} of {len(order)} shown, ")
            assert ("paper" in state["said"]) == (direction == "none") or column == 3
        assert states[2]["ids"] == order

    verdicts = dict(zip(table["id"], table["verdict"], strict=True))
    up, down = ([verdicts[name] for name in s["ids"]] for s in outcome["sorted"][0][:2])
    ranks = ["not reproduced", "inconclusive", "reproduced"]
    assert [*map(ranks.index, up)] == sorted(map(ranks.index, up))
    assert [*map(ranks.index, down)] == sorted(map(ranks.index, down), reverse=True)

    claims = load_claims().claims
    initials = [claims[name].statement[:1] for name in outcome["sorted"][1][0]["ids"]]
    assert initials == sorted(initials)
    sources = dict(zip(table["id"], table["source"], strict=True))
    up, down = (state["ids"] for state in outcome["sorted"][2][:2])
    places = list(dict.fromkeys(table["source"]))
    assert up == sorted(order, key=lambda name: places.index(sources[name]))
    found = list(dict.fromkeys(sources[name] for name in down))
    assert found == list(reversed(dict.fromkeys(table["source"])))
    numbers = [claim.paper for claim in claims.values() if claim.paper is not None]
    up = [claims[name].paper for name in outcome["sorted"][3][0]["ids"]]
    assert up == [*sorted(numbers), *[None] * (len(order) - len(numbers))]
    for column in (4, 5):
        key = keys(page, column)
        up, down = (state["ids"] for state in outcome["sorted"][column][:2])
        there = [name for name in order if key[name] is not None]
        assert up == sorted(there, key=lambda name: key[name] or []) + [
            name for name in order if key[name] is None
        ]
        assert [key[name] for name in down[: len(there)]] == [
            key[name] for name in reversed(up[: len(there)])
        ]
        assert all(key[name] is None for name in down[len(there) :])


def test_filters_show_what_they_say(outcome, table):
    counts = Counter(table["verdict"])
    everything = outcome["filtered"].pop("")
    assert everything["visible"] == list(table["verdict"])
    assert set(outcome["filtered"]) == set(counts)
    for verdict, state in outcome["filtered"].items():
        assert state["visible"] == [verdict] * counts[verdict]
        assert state["pressed"] == [verdict]
        assert state["said"].startswith(f"{counts[verdict]} of {len(table)} shown")
    both = table[(table["verdict"] == "inconclusive") & (table["source"] == "Figure 3")]
    assert len(both) > 0
    assert outcome["both"]["visible"] == ["inconclusive"] * len(both)


def test_a_link_to_a_claim_finds_it_whatever_is_filtered(outcome, table):
    linked = outcome["linked"]
    assert linked["before"] is True
    assert linked["after"] is False
    assert 0 <= linked["top"] < 900
    assert linked["said"].startswith(f"{len(table)} of {len(table)} shown")


def test_no_page_is_wider_than_its_screen(page, browser):
    for width, told in browser.run_at_widths(page.html, WIDTHS, (320, 390, 620, 961, 1280)).items():
        assert told["inner"] >= width - 20  # but for a scroll bar
        assert told["scroll"] <= told["inner"], width
        assert told["controls"] > 0
        assert told["details"] == 5


def test_what_is_closed_on_the_screen_is_printed(page, browser):
    assert browser.run(page.html, CLOSED) == [False] * 5
    as_printed = page.html.replace("@media print", "@media screen")
    assert browser.run(as_printed, CLOSED) == [True] * 5
