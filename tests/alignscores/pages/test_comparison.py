"""The page of a comparison: structure, sliders, and the pages of single sequences in it."""

import json
import re
import shutil
from base64 import b64decode
from dataclasses import FrozenInstanceError, replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

import alignscores
from alignscores.cli import main
from alignscores.comparison.benchmark import Run
from alignscores.comparison.runs import COLUMNS, Outcome
from alignscores.comparison.summary import summarise
from alignscores.comparison.tables import Names
from alignscores.explorer import source
from alignscores.pages.comparison import (
    _cell,
    _cells,
    _colour_and_dash,
    _differences,
    _errors,
    _needed,
    _quantiles,
    _runs,
    _trajectories,
)
from alignscores.pages.sequences import _estimate, _middle
from alignscores.pages.trajectories import page_without_data
from alignscores.trajectories.formats import FORMATS

ARRAYS = "rows", "statuses", "position_errors", "rotation_errors", "positions"
YAML = """\
format: tum
reference: "{sequence}/gt.txt"
estimate: "{sequence}/{system}/{run}.txt"
runs: 3
systems:
  a_b: {name: <A>, runs: 4}
"""


@pytest.fixture
def run(run_compare):
    return run_compare


class Structure(HTMLParser):
    """Tags that were opened and have to be closed; ids; and links."""

    VOID = "meta", "br", "input"

    def __init__(self):
        super().__init__()
        self.open, self.ids, self.links, self.texts = [], set(), [], []

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.ids.add(found.get("id"))
        self.links += [found[key] for key in ("href", "src") if key in found]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


DRIVER = """
const buttons = [...document.querySelectorAll("thead button")];
const first = () => document.querySelector("#overall tbody th").textContent;
const found = [first()];
for (let press = 0; press < 2; press++) { buttons[3].click(); found.push(first()); }
found.push(buttons[3].parentElement.getAttribute("aria-sort"));
found.push(document.documentElement.scrollWidth <= innerWidth);
tell(found);
"""


def test_page(patterns, run, tmp_path):
    (tmp_path / "b.yaml").write_text(YAML)
    run("b.yaml", "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    structure = Structure()
    structure.feed(text)
    assert structure.open == []
    assert structure.links
    assert all(link[0] == "#" and link[1:] in structure.ids for link in structure.links)
    assert "<A>" in structure.texts
    spoken = re.findall('aria-label="(.*?)"', text)
    assert sum("&lt;A&gt;: 0." in words for words in spoken) == 4  # of each sequence two drawings
    assert not any("a_b" in words for words in spoken)
    for key in re.findall(r'<ul class="key">(.*?)</ul>', text):
        assert re.findall(r"</svg> ([^<]*)</li>", key) == ["&lt;A&gt;", "c"]
    assert text.count("<svg") == 2 * 2 + 2 * 2  # drawings, and keys of two systems
    run("b.yaml", "--html", "again.html", "--jobs", 1)
    assert (tmp_path / "again.html").read_text() == text


HEADINGS = {
    "overall": "Over all sequences",
    "sequences": "PAS by sequence",
    "differences": "Differences in PAS, over all",
    "runs": "PAS of each run",
    "thresholds": "Scores at other thresholds",
    "errors": "Position error along the way",
    "trajectories": "Trajectories, camera by camera",
}
TABLES = {  # their columns
    "overall": "system TAS RAS PAS half_m half_deg PAS_of_scored_runs failed_runs lost",
    "sequences": "system car helix",
    "differences": "systems for scores ahead would_do failing with_failures",
}


def test_sections_and_tables_of_the_page(patterns, run, tmp_path):
    run(*patterns, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    assert re.findall(r"<(?:title|h1)>(.*?)<", text) == 2 * ["2 systems on 2 sequences"]
    assert dict(re.findall(r'<a href="#(.*?)">(.*?)</a>', text)) == HEADINGS
    sections = dict(re.findall(r'<section id="(\w+)".*?</h2>(.*?)</section>', text, flags=re.S))
    assert list(sections) == list(HEADINGS)
    for name in ("runs", "errors"):  # the first sequence is unfolded
        assert re.findall(r"<details( open)?><summary>(\w+)<", sections[name]) == [
            *((" open", "car"), ("", "helix"))
        ]
    assert "<caption>Means over all sequences. Bold: ahead of every other" in sections["overall"]
    rows = {}
    for name, headers in TABLES.items():
        found = re.findall(r'<th scope="col">(.*?)</th>', sections[name])
        assert " ".join(header.replace(" ", "_") for header in found) == headers
        body = re.findall("<tr>(.*?)</tr>", sections[name].partition("<tbody>")[2])
        rows[name] = [re.sub("(<.*?>)+", "|", row) for row in body]
    assert [row.split("|")[-4:-1] for row in rows["overall"]] == [
        ["0.8799", "0/6 (0-46 %)", "0.0%"],
        ["0.6407", "1/6 (0-64 %)", "16.7%"],
    ]
    assert rows["sequences"][1] == "|c|0.4223 |(2)|1 failed|0.6480 |(2)|"
    assert [row.split("|")[1:6:2] for row in rows["differences"]] == [
        ["a_b − c", "+0.239 (+0.223 to +0.256)", "2 runs"],
        ["a_b − c", "+0.239 (+0.137 to +0.341)", "2 sequences"],
    ]
    assert 'role="img" aria-label="PAS of each run. a_b: 0.8755, 0.8807, 0.8858; c: ' in text
    assert 'aria-label="Median position error along the way, up to 4 d. Typical: a_b: 0.14' in text
    # The first drawing is unfolded; each is as large as what it holds.
    for name, box in (("runs", "0 0 640 74"), ("errors", "0 0 700 320")):
        found = re.findall(r"<details( open)?><summary>(.*?)</summary>", sections[name])
        assert found == [(" open", "car"), ("", "helix")]
        assert re.findall(r'viewBox="(.*?)"', sections[name]) == [box, box]
    ends = re.findall(r'<text x="(\d+)" y="70"[^>]*>(.*?)<', sections["runs"])
    assert ends == 2 * [("130", "0"), ("640", "1")]
    assert sections["errors"].count('<text x="58" y="14">≥ ') == 2


def test_page_tells_what_changed(patterns, run, compare, tmp_path):
    (tmp_path / "saved.json").write_text(json.dumps(compare(*patterns)))
    _, out, _ = run(*patterns, "--baseline", "saved.json", "--html", "page.html")
    structure = Structure()
    structure.feed((tmp_path / "page.html").read_text())
    assert structure.open == []
    text = (tmp_path / "page.html").read_text()
    assert re.findall(r'<section id="(\w+)"', text)[:3] == ["overall", "changes", "sequences"]
    assert "Against saved.json, on what is in both." in structure.texts
    (_, *rows) = out.partition("against saved.json\n")[2].splitlines()
    for cell in rows[1].split()[:4]:
        assert cell in structure.texts


def cells_of_heat_map(patterns, run, tmp_path, by):
    """Return the values of the heat map and how strong the colours are, in per cent."""
    run(*patterns, "--by", by, "--html", "page.html")
    found = re.findall(r'--share:(\d+)%">([\d.]+|∞)', (tmp_path / "page.html").read_text())
    strengths, values = zip(*found, strict=True)
    return np.array([float(value.replace("∞", "inf")) for value in values]), list(
        map(int, strengths)
    )


def test_the_stronger_the_colour_the_better(patterns, run, tmp_path):
    """Scores go from 0 to 1, errors from the largest to the smallest."""
    scores, strengths = cells_of_heat_map(patterns, run, tmp_path, "PAS")
    assert strengths == pytest.approx(100 * scores, abs=0.51)
    errors, strengths = cells_of_heat_map(patterns, run, tmp_path, "half_distance")
    assert np.isinf(errors).sum() == 1  # a run is missing
    low, high = errors.min(), errors[np.isfinite(errors)].max()
    assert strengths == pytest.approx(
        100 * (high - np.minimum(errors, high)) / (high - low), abs=0.6
    )


@pytest.mark.parametrize("by", ["PAS", "half_distance"])
def test_dots_are_where_the_runs_are(patterns, run, compare, tmp_path, by):
    """From 0 to 1, or to the largest error of the sequence."""
    run(*patterns, "--by", by, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    results = compare(*patterns)["results"]
    expected = []
    for sequence in ("car", "helix"):
        values = [
            one[by]
            for system in ("a_b", "c")
            for one in results
            if (one["system"], one["sequence"]) == (system, sequence) and one[by] is not None
        ]
        end = 1.0 if by == "PAS" else max(values)
        expected += [130 + 502 * value / end for value in values]
        assert f'text-anchor="end">{end:.3g}</text>' in text
    dots = re.findall(r'class="dot" cx="([\d.]+)" cy="([\d.]+)"', text)
    assert [float(x) for x, _ in dots] == pytest.approx(expected, abs=0.06)
    # The name of a system ends before its line, in the middle of which its dots are.
    lines = re.findall(
        r'<text x="(\d+)" y="(\d+)" text-anchor="end">(a_b|c)</text>.*?M(.*?)H', text
    )
    assert lines == 2 * [("122", "17", "a_b", "130 13"), ("122", "43", "c", "130 39")]
    assert {y for _, y in dots} == {"13", "39"}


def test_the_curves_are_the_errors_of_their_sequence(patterns, run, tmp_path):
    """Each of the 60 cameras has a part of the way of its own: the median is that of the runs."""
    run(*patterns, "--unit", 0.8, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    runs = alignscores.compare(*patterns[1:], format="tum", unit=0.8).summary.runs
    expected = []
    for sequence in ("car", "helix"):
        for system in ("a_b", "c"):
            scored = [
                one
                for run, one in runs
                if (run.system, run.sequence) == (system, sequence) and one.n
            ]
            errors = np.median([one.position_errors for one in scored], axis=0) / scored[0].unit
            expected.append(20 + 260 * (1 - np.minimum(errors, 4) / 4))
        assert f"≥ {4 * scored[0].unit:.3g} (4 d)" in text
        assert own_pages(text)[sequence]["settings"]["unit"] == scored[0].unit
    for mark in (
        '<path class="axis" d="M52 20V280H692"/>',
        '<text x="52" y="298">start</text>',
        '<text x="692" y="298" text-anchor="end">end of the trajectory</text>',
        '<text x="46" y="280" text-anchor="end">0</text>',
    ):
        assert text.count(mark) == 2
    curves = re.findall(r'<polyline .*?stroke="var\(--c(\d)\)".*?points="(.*?)"', text)
    assert [int(colour) for colour, _ in curves] == [0, 1, 0, 1]
    for (_, points), heights in zip(curves, expected, strict=True):
        x, y = np.transpose([list(map(float, point.split(","))) for point in points.split()])
        assert x == pytest.approx(52 + 640 * (2 * np.arange(60) + 1.5) / 120, abs=0.06)
        assert y == pytest.approx(heights, abs=0.06)


def test_the_page_tells_which_system_is_ahead(patterns, run, compare, tmp_path):
    """Over all sequences, for each question."""
    run(*patterns, "--html", "page.html")
    cell = "<td>[^<]*</td>"
    pair = r'<th scope="row">([^<]*) − ([^<]*)</th>'
    row = rf"{pair}{cell}<td>([^<]*)</td><td>(first|second|no)</td>"
    words = {"a": "first", "b": "second", None: "no"}
    expected = [
        (pair["a"], pair["b"], interval(**pair[question]), words[pair[question]["better"]])
        for pair in compare(*patterns)["comparisons"]
        if (pair["sequence"], pair["metric"]) == (None, "PAS")
        for question in ("new_runs", "new_sequences")
    ]
    assert {one[-1] for one in expected} >= {"first"}
    assert re.findall(row, (tmp_path / "page.html").read_text()) == expected


def difference(value, better=None, **more):
    return {
        "difference": value,
        "low": value - 0.25,
        "high": value + 0.25,
        "better": better,
        **more,
    }


def test_pairs_are_told_apart_over_all_sequences():
    """For new runs, and for new sequences where there is an answer; by the metric of the page."""
    failing = {"failing": difference(0.0), "with_failures": difference(1.0)}
    pair = {"sequence": None, "metric": "PAS", "a": "x", "b": "y"}
    comparisons = [
        pair | {"new_runs": difference(0.5, "a", needed=3, **failing), "new_sequences": None},
        pair
        | {"a": "y", "b": "z"}
        | {"new_runs": difference(-0.5, "b", needed=None, **failing)}
        | {"new_sequences": difference(0.125, needed=12, **failing)},
        pair | {"metric": "TAS"},
        pair | {"sequence": "car"},
    ]
    html = _differences(
        SimpleNamespace(comparisons=comparisons), "PAS", Names({"x": "<x>", "y": "y", "z": "z"}, {})
    )
    rows = re.findall("<tr>(.*?)</tr>", html.partition("<tbody>")[2])
    both = "+0.000 (−0.250 to +0.250)", "+1.000 (+0.750 to +1.250)"
    runs, sequences = "new runs on these sequences", "new sequences like these"
    expected = [
        ("&lt;x&gt; − y", runs, "+0.500 (+0.250 to +0.750)", "first", "3 runs", *both),
        ("y − z", runs, "−0.500 (−0.750 to −0.250)", "second", "more than 1000 runs", *both),
        ("y − z", sequences, "+0.125 (−0.125 to +0.375)", "no", "12 sequences", *both),
    ]
    assert rows == [
        f'<th scope="row">{first}</th>' + "".join(f"<td>{cell}</td>" for cell in cells)
        for first, *cells in expected
    ]


@pytest.mark.parametrize(
    ("by", "values", "dots", "ends"),
    [
        # From label to end there are 502 pixels.
        ("PAS", [0.0, 0.5, 1.0], ["130.0", "381.0", "632.0"], ("0", "1")),
        ("half_distance", [1.0, np.inf, 4.0], ["255.5", "632.0"], ("0", "4")),
        ("half_distance", [np.inf], [], ("0", "1e-09")),
        ("kitti", [-1.0, 0.0, 4.0], ["130.0", "230.4", "632.0"], ("-1", "4")),
    ],
)
def test_dots_lie_between_nothing_and_the_largest_value(by, values, dots, ends):
    """Scores between 0 and 1; what is not finite has no dot, but is spoken."""
    result = {"system": "a", "sequence": "q", "metrics": {}}
    results = [
        result | ({"metrics": {by: value}} if by == "kitti" else {by: value}) for value in values
    ]
    others = [result | {"system": "b", by: 0.25}, result | {"sequence": "other", by: 9.0}]
    summary = SimpleNamespace(systems=["a"], results=[*results, *others])
    html = _runs(summary, by, "q", Names({"a": "<a>"}, {}))
    assert re.findall(r'cx="(.*?)" cy="13"', html) == dots
    assert re.findall(r'y="44"(?: text-anchor="end")?>(.*?)<', html) == list(ends)
    spoken = ", ".join("∞" if value == np.inf else f"{value:.4f}" for value in values)
    assert f'aria-label="{by} of each run. &lt;a&gt;: {spoken}"' in html
    assert ">&lt;a&gt;</text>" in html


def test_a_curve_is_the_median_of_all_runs_in_each_part_and_ends_at_4_d():
    """Two cameras of each of two runs are in the first part of 120, and two in the second."""

    def run(name, errors):
        rows = {"rows": np.arange(4), "n_rows": 240, "n": 4}
        outcome = Outcome({}, position_errors=np.array(errors), unit=0.5, **rows)
        return Run("q", "b", name, "file"), outcome

    runs = [
        run("0", [0.5, 1.0, 9.0, np.inf]),
        (Run("q", "a", "0", "file"), Outcome({}, error="none")),
        run("1", [100.0, 0.5, 9.0, 9.0]),
    ]
    names = Names({"a": "<a>", "b": "<b>"}, {})
    html = _errors(SimpleNamespace(systems=["b", "a"], runs=runs), "q", names)
    assert re.findall("<polyline (.*?)/>", html) == [
        'class="curve" stroke="var(--c1)" stroke-dasharray="6 3" points="54.7,182.5 60.0,20.0"'
    ]
    assert ">≥ 2 (4 d)</text>" in html
    assert 'up to 4 d. Typical: &lt;b&gt;: 2.8 d"' in html  # between 1.5 d and 4 d
    nothing = SimpleNamespace(systems=["a"], runs=runs)
    assert _errors(nothing, "q", names) == "<p>No run was scored.</p>"


def interval(difference, low, high, **_):
    return f"{difference:+.3f} ({low:+.3f} to {high:+.3f})".replace("-", "−")


def test_the_page_holds_quantiles_of_the_errors_of_each_system(patterns, run, tmp_path):
    """Each run counts the same, one that is missing as infinite errors; none where not tried."""
    shutil.rmtree(tmp_path / "helix" / "a_b")
    options = {"unit": 0.8, "max_threshold": 0.5, "max_threshold_deg": 7.0, "weight": 0.25}
    given = [part for name, value in options.items() for part in (f"--{name}", value)]
    run(*patterns, *given, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    assert re.search(r"script-src 'unsafe-inline'; frame-src blob:\"", text)
    for part in ("style.css", "scores.js", "charts.js", "controls.js", "tables.js"):
        assert source(part) in text
    (found,) = re.findall(r'id="data">(.*?)</script>', text)
    data = json.loads(found)
    errors = data.pop("errors")
    assert data == {
        "systems": ["a_b", "c"],
        "lines": [["var(--c0)", "none"], ["var(--c1)", "6 3"]],
        "sequences": ["car", "helix"],
        "setting": {"threshold": 0.5, "degrees": 7.0, "weight": 0.25},
    }
    summary = alignscores.compare(*patterns[1:], format="tum", **options).summary
    place = np.floor((np.arange(400) + 0.5) / 400 * 3 * 60).astype(int)  # of three runs
    for sequence, of_sequence in zip(("car", "helix"), errors, strict=True):
        for system, packed in zip(("a_b", "c"), of_sequence, strict=True):
            if (system, sequence) == ("a_b", "helix"):
                assert packed is None
                continue
            scored = [
                one
                for run, one in summary.runs
                if (run.system, run.sequence) == (system, sequence) and one.n
            ]
            assert len(scored) == (2 if (system, sequence) == ("c", "car") else 3)
            kinds = {
                "position": [one.position_errors / one.unit for one in scored],
                "rotation": [one.rotation_errors for one in scored],
            }
            assert set(packed) == set(kinds)
            for kind, values in kinds.items():
                pooled = np.sort(np.concatenate([*values, np.full(180, np.inf)]))
                read = np.frombuffer(b64decode(packed[kind]), "<f4")
                np.testing.assert_array_equal(read, pooled[place].astype("<f4"))


def test_long_names_are_cut_beside_the_dots(benchmark_of, run, tmp_path):
    names = ["a" * 18, "b" * 19]
    systems = dict.fromkeys(names, (0.1, 1.0, 1, 0.0))
    run(*benchmark_of(systems, ["car"], 1, n=20), "--html", "page.html")
    section = (tmp_path / "page.html").read_text().partition('<section id="runs"')[2]
    found = re.findall(r'text-anchor="end">([ab]+)</text>', section.partition("</section>")[0])
    assert found == [18 * "a", 18 * "b"]


def test_errors_that_do_not_differ_have_no_colour(benchmark_of, run, tmp_path):
    """Nor has one that is infinite."""
    patterns = benchmark_of({"a": (0.1, 1.0, 1, 0.0), "b": (0.1, 1.0, 1, 0.8)}, ["car"], 1, n=20)
    values, strengths = cells_of_heat_map(patterns, run, tmp_path, "half_distance")
    assert np.isinf(values).tolist() == [False, True]
    assert strengths == [0, 0]


def test_the_best_are_bold(patterns, run, compare, tmp_path):
    run(*patterns, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    table = text.partition('<section id="overall"')[2]
    entries = compare(*patterns)["systems"]
    systems = [one for one in entries if one["sequence"] is None]
    ranks = {(one["system"], one["sequence"]): one["rank"]["PAS"] for one in entries}
    shown = re.findall(r'<td class="heat( best)?"', text)
    assert list(map(bool, shown)) == [
        ranks[system, sequence] == [1, 1]
        for system in ("a_b", "c")
        for sequence in ("car", "helix")
    ]
    assert len(set(shown)) == 2
    rows = re.findall(r'<tr><th scope="row">(.*?)</th>(.*?)</tr>', table)
    for (name, row), system in zip(rows[:2], systems, strict=True):
        assert name == system["system"]
        cells = re.findall(r'<td data-key="[^"]*"( class="best")?>', row)
        ranks = system["rank"].values()
        assert list(map(bool, cells[: len(ranks)])) == [rank == [1, 1] for rank in ranks]


def test_curves_of_forty_systems_look_different():
    assert len({_colour_and_dash(index) for index in range(40)}) == 40


@pytest.mark.parametrize(
    ("index", "colour", "dash"),
    [
        *((0, 0, "none"), (1, 1, "6 3"), (2, 2, "none"), (7, 7, "6 3"), (8, 0, "2 3")),
        *((9, 1, "8 3 2 3"), (16, 0, "1 2"), (17, 1, "none"), (24, 0, "6 3"), (40, 0, "none")),
    ],
)
def test_neighbours_differ_in_colour_and_dash(index, colour, dash):
    """The colours repeat after eight, then with other dashes."""
    assert _colour_and_dash(index) == (f"var(--c{colour})", dash)


@pytest.mark.parametrize(
    ("value", "text", "rank", "cell"),
    [
        (0.5, "0.5000", None, '<td data-key="0.5">0.5000</td>'),
        (1 / 3, "x", [2, 3], '<td data-key="0.333333333">x <span class="rank">(2-3)</span></td>'),
        (2, "2", [1, 1], '<td data-key="2" class="best">2 <span class="rank">(1)</span></td>'),
        (np.inf, "∞", [1, 2], '<td data-key="1e999">∞ <span class="rank">(1-2)</span></td>'),
        (np.nan, "-", None, '<td data-key="1e999">-</td>'),
    ],
)
def test_cells_have_what_to_sort_them_by(value, text, rank, cell):
    """What is not finite comes last; the first alone is bold."""
    assert _cell(value, text, rank) == cell


def test_differences_have_signs_and_intervals_or_are_unknown():
    known = {"difference": -0.25, "low": -0.5, "high": 0.0004}
    wide = {"difference": 0.25, "low": -1.0, "high": np.inf}
    unknown = {"difference": 0.25, "low": -np.inf, "high": np.inf}
    assert _cells(known, wide, unknown) == (
        "<td>−0.250 (−0.500 to +0.000)</td><td>+0.250 (−1.000 to unknown)</td><td>unknown</td>"
    )
    assert _cells() == ""
    assert (_needed(0), _needed(12), _needed(None)) == ("0", "12", "more than 1000")


def test_page_sorts_and_fits_a_phone(patterns, run, tmp_path, browser):
    (tmp_path / "b.yaml").write_text(YAML)
    run("b.yaml", "--html", "page.html")
    html = (tmp_path / "page.html").read_text()
    (told,) = browser.run_at_widths(html, DRIVER, (390,)).values()
    assert told == ["<A>", "<A>", "c", "ascending", True]


SLIDERS = """
const text = (cell) => cell.textContent;
const rows = [...document.querySelectorAll("#scores tr")];
const texts = rows.map((row) => [...row.cells].slice(1).map(text));
const scores = texts.map((cells) => cells.map(Number));
const names = rows.map((row) => text(row.cells[0]));
tell({ names, texts, scores, setting: text(document.getElementById("setting")) });
"""


@pytest.mark.parametrize("options", [{}, {"threshold": 0.35, "degrees": 2.5, "weight": 0.2}])
def test_scores_at_other_thresholds(patterns, run, compare, tmp_path, browser, options):
    """They are those of the command with these, as the paper's registration depends on none."""
    settings = "--registration", "pcr99", "--repeat", 1
    run(*patterns, *settings, "--html", "page.html")
    html = (tmp_path / "page.html").read_text()
    names = {"threshold": "--max_threshold", "degrees": "--max_threshold_deg", "weight": "--weight"}
    given = [argument for key, value in options.items() for argument in (names[key], value)]
    systems = compare(*patterns, *settings, *given)["systems"]
    chosen = "&".join(f"{key}={value}" for key, value in options.items())
    for index, sequence in ((-1, None), (1, "helix"), (0, "car")):
        told = browser.run(html, SLIDERS, f"#sequence={index}&{chosen}")
        entries = [one for one in systems if one["sequence"] == sequence]
        assert set(told["names"]) == {one["system"] for one in entries}
        for one in entries:
            found = told["scores"][told["names"].index(one["system"])]
            expected = [one[name] for name in ("TAS", "RAS", "PAS")]
            assert 0 < min(expected) < max(expected) < 1
            assert found == pytest.approx(expected, abs=0.0018)  # and three digits
        assert told["setting"].endswith("not as in the run." if options else ": as in the run.")


def test_scores_of_a_system_that_was_not_tried_everywhere(patterns, run, tmp_path, browser):
    """Overall they are those of the other sequence."""
    html = {}
    for name in ("everywhere", "elsewhere"):
        run(*patterns, "--html", f"{name}.html")
        html[name] = (tmp_path / f"{name}.html").read_text()
        shutil.rmtree(tmp_path / "helix" / "a_b", ignore_errors=True)
    all_of_it, there, not_there = (
        dict(zip(told["names"], told["texts"], strict=True))
        for told in (
            browser.run(html["elsewhere"], SLIDERS, "#sequence=-1"),
            browser.run(html["everywhere"], SLIDERS, "#sequence=0"),
            browser.run(html["elsewhere"], SLIDERS, "#sequence=1"),
        )
    )
    assert all_of_it["a_b"] == there["a_b"]
    assert all_of_it["c"] != there["c"]
    assert not_there["a_b"] == ["not tried"] * 3


def own_pages(text):
    """Return the data of the pages of one's own files in a page, by the sequences in the menu."""
    data = re.findall(r'<script type="application/json" id="own-\d+">(.*?)</script>', text)
    options = re.findall(r'<option value="\d+">(.*?)</option>', text)
    return dict(zip(options, map(json.loads, data), strict=True))


@pytest.mark.parametrize(
    ("format", "reference", "estimates"),
    [
        ("tum", "tum/reference.txt", "tum/{system}mate.txt"),
        ("kitti", "kitti/reference.txt", "kitti/{system}mate.txt"),
        ("colmap", "colmap/reference", "colmap/{system}mate"),
        ("nerf", "nerf/reference.json", "nerf/{system}mate.json"),
    ],
)
def test_the_page_has_the_cameras_of_the_command(
    run, examples, tmp_path, monkeypatch, format, reference, estimates
):
    monkeypatch.chdir(examples)
    run(format, reference, estimates, "--html", tmp_path / "page.html", "--jobs", 1)
    (one,) = own_pages((tmp_path / "page.html").read_text()).values()
    assert one["estimates"][0]["name"] == "esti"  # of one run it is not said which
    settings = ["--registration", "refined", "--unit", str(one["settings"]["unit"])]
    settings += [] if format == "kitti" else ["--missing", "fail"]
    files = [reference, estimates.replace("{system}", "esti")]
    assert main([format, *files, *settings, "--save_page", str(tmp_path / "own.html")]) == 0
    own = (tmp_path / "own.html").read_text()
    alone = json.loads(re.search(r'id="data">(.*?)</script>', own)[1])
    for data in (one, alone):
        assert data.pop("title")
        assert data["estimates"][0].pop("name").startswith("esti")
        data["estimates"][0].pop("notes")
        assert [type(level) for level in data["estimates"][0]["half"]] == [float, float]
    assert one == alone


FRAMED = """<script>
const rows = [...document.querySelectorAll("#rows tr")];
const table = rows.map((row) => [...row.cells].map((cell) => cell.textContent.trim()));
const isRun = document.getElementById("reset").disabled;
const picked = document.getElementById("picked").textContent;
parent.postMessage([document.title, isRun, table, picked], "*");
window.setTimeout = (call) => call(); // the browser does not wait for a frame's clock
document.getElementById("scene").dispatchEvent(new KeyboardEvent("keydown", { key: "PageDown" }));
</script></body>"""

# At the beginning of the page around it, since the frame may speak before the page has ended.
LISTENING = """<body><script>
const heard = [];
addEventListener("message", ({ data }) => heard.push(data));
</script>"""
# At its end. With nothing to do the browser lets its clock run out, though the frame still loads.
AROUND = """
const busy = new MessageChannel();
busy.port1.onmessage = () => {
  if (heard.length < 2) busy.port2.postMessage(0);
  else setTimeout(() => tell([...heard.find(Array.isArray), location.hash]), 300);
};
busy.port2.postMessage(0);
"""


def test_one_run_of_each_system_is_in_a_frame(patterns, run, compare, tmp_path, browser):
    """The one in the middle, of two the lesser one; of sequences of which any was scored."""
    for system in ("a_b", "c"):
        for file in (tmp_path / "helix" / system).iterdir():
            file.write_text("")
    run(*patterns, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    assert list(own_pages(text)) == ["car"]
    end, script = (json.dumps(one)[1:-1].replace("<", r"\u003c") for one in ("</body>", FRAMED))
    assert text.count(end) == 1
    assert text.count("<body>") == 1
    around = text.replace(end, script).replace("<body>", LISTENING)
    told = browser.run(around, AROUND, "#view=camera%3D3")
    title, is_run, table, picked, address = told
    assert picked.startswith("Camera 0.3: position error ")
    assert address == "#view=camera%3D4"  # as the frame's own cannot be shared
    assert (title, is_run) == ("car: one run of each system", True)
    results = [one for one in compare(*patterns)["results"] if one["sequence"] == "car"]
    for row, (system, index) in zip(table, (("a_b", 1), ("c", 0)), strict=True):
        scored = [one for one in results if (one["system"], one["status"]) == (system, "scored")]
        chosen = sorted(scored, key=lambda one: one["PAS"])[index]
        assert row[0] == f"{system}, run {chosen['run']}"
        assert row[1:4] == [f"{chosen[name]:.4f}" for name in ("TAS", "RAS", "PAS")]
        assert row[5:7] == ["60", "0"]


@pytest.mark.parametrize(
    ("by", "values", "middle"),
    [
        ("PAS", [0.1], "0"),
        ("PAS", [0.1, 0.2], "0"),
        ("PAS", [0.5, 0.1, 0.2, 0.4, 0.3], "4"),
        ("PAS", [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], "2"),
        ("PAS", [0.5, 0.5, 0.5], "1"),  # as they were found
        ("half_distance", [0.1, 0.2], "1"),
        ("half_distance", [0.1, 0.3, 0.2], "2"),
        ("half_distance", [0.1, 0.2, 0.3, 0.4], "2"),
    ],
)
def test_the_run_in_the_middle_stands_for_its_system(by, values, middle):
    """Of two the lesser one: of lower score, or of larger error."""
    runs = [
        (
            Run("q", "a", str(number), "file"),
            Outcome(dict.fromkeys(COLUMNS, 0.5) | {by: value}, n=1),
        )
        for number, value in enumerate(values)
    ]
    others = [
        (Run("q", "b", "9", "file"), Outcome(dict.fromkeys(COLUMNS, 0.3), n=1)),
        (Run("q", "a", "9", "file"), Outcome({}, error="none")),
    ]
    summary = summarise([*others, *runs], [], FORMATS["tum"])
    run, outcome = _middle(summary, by, "a", "q")
    assert (run.run, outcome.scores[by]) == (middle, values[int(middle)])
    assert _middle(summarise(others, [], FORMATS["tum"]), by, "a", "q") is None


@pytest.mark.parametrize(
    ("runs", "failed", "name", "told"),
    [
        (1, 0, "<A>", []),
        (2, 0, "<A>, run 7\\n", []),
        (2, 1, "<A>, run 7\\n", ["of its 2 runs, 1 failed or are missing"]),
    ],
)
def test_what_the_page_shows_of_a_run(runs, failed, name, told):
    """First how many runs failed, then what is noted of this one."""
    numbers = {key: np.array([number]) for number, key in enumerate(ARRAYS)}
    scores = {"TAS": 0.5, "RAS": 0.75, "PAS": 0.625, "half_distance": 0.1, "half_angle": np.inf}
    outcome = Outcome(scores, n=1, notes=["first\n", "second"], **numbers)
    entries = {("a", "q"): {"runs": runs, "failed_runs": failed}}
    found = _estimate(
        Run("q", "a", "7\n", "f\n.txt"),
        outcome,
        SimpleNamespace(entries=entries),
        Names({"a": "<A>"}, {}),
    )
    assert vars(found) == {
        **{"name": name, "file": "f\\n.txt", "tas": (0.5, None), "pas": (0.625, None)},
        **{"half": (0.1, np.inf)},
        **numbers,
        "notes": [f"{name}: {note}" for note in [*told, "first\\n", "second"]],
    }
    assert found != replace(found)  # by what it is, not by its arrays
    with pytest.raises(FrozenInstanceError):
        found.name = "another"


def test_a_page_of_one_s_own_tells_of_runs_that_failed(patterns, run, tmp_path):
    run(*patterns, "--html", "page.html")
    _, lacking = own_pages((tmp_path / "page.html").read_text())["car"]["estimates"]
    assert lacking["notes"][0].endswith(": of its 3 runs, 1 failed or are missing")


def test_without_a_run_that_was_scored_the_page_says_so(patterns, run, tmp_path):
    for path in tmp_path.glob("*/*/*.txt"):
        path.write_text("")
    run(*patterns, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    assert text.count("<p>No run was scored.</p></div></details>") == 2  # errors of each sequence
    assert "camera by camera</h2><p>No run was scored.</p></section>" in text
    assert own_pages(text) == {}


def test_the_unit_is_that_of_the_scored_runs_of_the_sequence(patterns, run, compare, tmp_path):
    (tmp_path / "car/a_b/0.txt").write_text("")
    run(*patterns, "--html", "page.html")
    pages = own_pages((tmp_path / "page.html").read_text())
    units = {
        one["sequence"]: one["unit"]
        for one in compare(*patterns)["results"]
        if one["status"] == "scored"
    }
    assert {sequence: page["settings"]["unit"] for sequence, page in pages.items()} == units
    assert len(set(units.values())) == 2


def test_sequences_without_a_scored_run_have_no_page_of_their_own(patterns, run, tmp_path):
    """Those after them have."""
    for path in tmp_path.glob("car/*/*.txt"):
        path.write_text("")
    run(*patterns, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    assert list(own_pages(text)) == ["helix"]
    (parts,) = re.findall(r'id="own-page">(.*?)</script>', text)
    assert json.loads(parts) == page_without_data()


def test_one_system_has_nothing_to_be_compared_with(benchmark_of, run, tmp_path):
    run(*benchmark_of({"only": (0.1, 1.0, 1, 0.0)}, ["car"], 1, n=20), "--html", "page.html")
    section = (tmp_path / "page.html").read_text().partition('<section id="differences"')[2]
    assert "</h2><p>There is nothing to compare: one system, or one run of each.</p>" in section


def test_what_was_not_tried_is_told_in_the_heat_map(patterns, run, tmp_path):
    shutil.rmtree(tmp_path / "car/a_b")
    run(*patterns, "--html", "page.html")
    (table,) = re.findall(
        '<section id="sequences".*?</section>', (tmp_path / "page.html").read_text()
    )
    (row,) = re.findall("<tr><th[^>]*>a_b</th>(.*?)</tr>", table)
    assert row.startswith("<td>not tried</td><td ")


def test_trajectories_that_are_too_large_are_left_out(patterns, run, tmp_path, monkeypatch):
    run(*patterns, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    elements = re.findall(r'<script type="application/json" id="own-\d.*?</script>', text)
    size = sum(map(len, elements)) / 1e6
    monkeypatch.setattr("alignscores.pages.comparison.MOST", 0.01)
    run(*patterns, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    assert own_pages(text) == {}
    left_out = f"take {size:.3g} MB, more than 0.01 MB, and are left out. <code>alignscores FORMAT "
    assert left_out in text


@pytest.mark.parametrize(("size", "is_there"), [(15_000_000, True), (15_100_000, False)])
def test_fifteen_megabytes_of_trajectories_are_not_too_large(monkeypatch, size, is_there):
    monkeypatch.setattr("alignscores.pages.comparison.data_element", lambda name, data: size * "x")
    html = _trajectories({"car": {}}, "PAS", Names({}, {"car": "<car>"}))
    assert html.count('<option value="0">&lt;car&gt;</option>') == is_there
    assert html.count("would take 15.1 MB, more than 15 MB, and are left out") == (not is_there)


def test_the_run_of_each_system_and_what_is_noted_of_it(patterns, run, compare, tmp_path):
    """The one in the middle, of two the lesser one."""
    run(*patterns, "--html", "page.html")
    pages = own_pages((tmp_path / "page.html").read_text())
    assert list(pages) == ["car", "helix"]
    results = compare(*patterns)["results"]
    for sequence, page in pages.items():
        assert page["title"] == f"{sequence}: one run of each system"
        for shown, system in zip(page["estimates"], ("a_b", "c"), strict=True):
            scored = sorted(
                (one["PAS"], one["run"], one)
                for one in results
                if (one["system"], one["sequence"]) == (system, sequence)
                and one["status"] == "scored"
            )
            chosen = scored[(len(scored) - 1) // 2][-1]
            name = f"{system}, run {chosen['run']}"
            assert shown["name"] == name
            assert shown["file"] == f"{sequence}/{system}/{chosen['run']}.txt"
            assert shown["TAS"] == [chosen["TAS"], None]
            assert shown["PAS"] == [chosen["PAS"], None]
            assert shown["half"] == [chosen["half_distance"], chosen["half_angle"]]
            failed = (system, sequence) == ("c", "car")
            lost = "of its 3 runs, 1 failed or are missing"
            assert (f"{name}: {lost}" in shown["notes"]) == failed


def test_what_was_not_tried_is_an_empty_place(patterns, run, tmp_path):
    """The sequences after it keep their columns."""
    shutil.rmtree(tmp_path / "car" / "a_b")
    run(*patterns, "--html", "page.html")
    table = (tmp_path / "page.html").read_text().partition('<section id="sequences"')[2]
    rows = re.findall(r"<tr>(.*?)</tr>", table.partition("<tbody>")[2].partition("</tbody>")[0])
    (row,) = (re.sub("(<.*?>)+", "|", row) for row in rows if ">a_b<" in row)
    assert re.fullmatch(r"\|a_b\|not tried\|0\.\d{4} ?\|.*", row)


def test_of_one_system_nothing_is_compared(patterns, run, tmp_path):
    for sequence in ("car", "helix"):
        shutil.rmtree(tmp_path / sequence / "c")
    run(*patterns, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    assert "<p>There is nothing to compare: one system, or one run of each.</p>" in text
    assert re.findall("<caption>(.*?)</caption>", text) == [
        "Means over all sequences.",
        "Means over the runs, the stronger the colour, the better.",
    ]
    assert re.findall(r"<(?:title|h1)>(.*?)<", text) == 2 * ["1 system on 2 sequences"]


def quantiles(errors, n_runs):
    found = _quantiles(list(map(np.array, errors)), n_runs)
    return np.frombuffer(b64decode(found), "<f4").tolist()


def test_quantiles_stand_for_the_errors_of_all_runs():
    """Each is the middle one of a four hundredth; each run counts the same."""
    errors = np.arange(1.0, 1201)
    assert quantiles([errors[::-1]], 1) == [3 * i + 2 for i in range(400)]
    assert quantiles([errors[:200]], 2) == [*range(1, 201), *[np.inf] * 200]  # one has failed
    assert quantiles([np.full(300, 2.0), np.full(100, 1.0)], 2) == [1.0] * 200 + [2.0] * 200
    assert quantiles([], 3) == [np.inf] * 400
