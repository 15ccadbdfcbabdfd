"""The page in a browser: sorting, filtering, links, and nothing wider than a phone."""

from collections import Counter

import pytest

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
document.querySelectorAll("details").forEach((each) => { each.open = true; });
tell({
  scroll: root.scrollWidth,
  inner: innerWidth,
  controls: document.getElementById("controls").offsetHeight,
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


def test_every_column_sorts_up_down_and_back(outcome, page, table):
    order = list(table["id"])
    assert outcome["controls"] > 0
    assert len(outcome["sorted"]) == 6
    for column, states in enumerate(outcome["sorted"]):
        up, down, back = (state["ids"] for state in states)
        assert [state["sorts"][column] for state in states] == ["ascending", "descending", "none"]
        assert back == order
        assert sorted(up) == sorted(down) == sorted(order)
        assert up != order or column == 2  # the sources stand in this order
        assert down != order
    ranks = ["not reproduced", "inconclusive", "reproduced"]
    verdicts = dict(zip(table["id"], map(ranks.index, table["verdict"]), strict=True))
    paper = dict(zip(table["id"], table["paper"], strict=True))
    up, down = ([verdicts[name] for name in s["ids"]] for s in outcome["sorted"][0][:2])
    assert up == sorted(up)
    assert down == sorted(down, reverse=True)
    numbers = [paper[name] for name in outcome["sorted"][3][0]["ids"]][: table["paper"].count()]
    assert numbers == sorted(table["paper"].dropna())


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


def test_what_is_closed_on_the_screen_is_printed(page, browser):
    on_screen = browser.run(page.html, CLOSED)
    assert on_screen
    assert not any(on_screen)
    as_printed = page.html.replace("@media print", "@media screen")
    assert all(browser.run(as_printed, CLOSED))
