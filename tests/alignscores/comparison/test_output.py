"""What is printed and saved: table, CSV, Markdown, LaTeX, YAML as input, and the page."""

import csv
import json
import os
import re
import shutil
import subprocess
from html.parser import HTMLParser
from io import StringIO

import pytest

from alignscores.cli import main

SYSTEMS = {"a_b": (0.1, 1.0, 1, 0.0), "c": (0.3, 3.0, 1, 0.0)}


@pytest.fixture
def patterns(benchmark_of, tmp_path):
    found = benchmark_of(SYSTEMS, n=60)
    (tmp_path / "car/c/2.txt").unlink()
    return found


def test_text(patterns, run):
    code, out, err = run(*patterns)
    assert code == 1
    assert err == "alignscores: error: c: has no run 2 on car; it counts as a failure\n"
    *overall, by_sequence, notes = out.strip().split("\n\n")  # in as many pieces as it takes
    assert re.match(r"system  rank \(PAS\) +TAS +RAS +PAS +half d +half angle", overall[0])
    assert overall[-1].splitlines()[0].endswith("lost frames")
    header, first, second = by_sequence.splitlines()
    assert header.split() == ["PAS", "car", "helix"]
    assert re.fullmatch(r"a_b +0\.\d{4} \([12-]+\) +0\.\d{4} \(1\)", first)
    assert re.fullmatch(r"c +0\.\d{4} \([12-]+\) †1 +0\.\d{4} \(2\)", second)
    assert "†1: so many runs failed or are missing" in notes
    assert max(map(len, out.splitlines())) <= 100


def test_csv_and_markdown(patterns, run):
    rows = list(csv.DictReader(run(*patterns, "--csv")[1].splitlines()))
    assert [(row["sequence"], row["system"]) for row in rows] == [
        (sequence, system) for sequence in ("car", "helix", "") for system in ("a_b", "c")
    ]
    assert rows[1]["failed_runs"] == "1"
    text = run(*patterns, "--markdown", "--by", "TAS")[1]
    value = f"{float(rows[2]['TAS']):.4f}"
    assert re.search(rf"^\| a_b \| [^|]+ \| \*\*{value}\*\* \(1\) \|$", text, re.MULTILINE)
    tables = [re.findall(r"\|", line) for line in text.split("\n\n")[1].splitlines()]
    assert len(set(map(len, tables))) == 1


def test_latex(patterns, run, tmp_path):
    text = run(*patterns, "--latex")[1]
    for part in (r"\toprule", r"\midrule", r"\bottomrule", r"a\_b & ", r"\textsuperscript{\dag1}"):
        assert part in text
    lines = [line for line in text.splitlines() if line.endswith(r"\\")]
    assert {line.count(" & ") for line in lines} == {3}
    assert re.search(r"a\\_b & .* & \\textbf\{0\.\d{4}\} & ", text)  # certain on the helix alone
    assert text.count("textbf") == 1


NAMES = r"[1] a&b%c_d#e$f~g^h\i{j}|<k>", "*{2} é"


def test_latex_of_any_names(patterns, run, tmp_path):
    """Whatever a name or a metric holds, it is text."""
    sequences = {"car": {"name": NAMES[0]}}
    systems = {"a_b": {"name": NAMES[0]}, "c": {"name": NAMES[1]}}
    described = {"format": "tum", "reference": patterns[1], "estimate": patterns[2]}
    described |= {"sequences": sequences, "systems": systems}
    (tmp_path / "b.yaml").write_text(json.dumps(described))
    text = run("b.yaml", "--latex", "--by", "half_distance")[1]
    comment, *lines = text.splitlines()
    assert comment.startswith("% half_distance: ")
    escaped = (
        r"{[}1] a\&b\%c\_d\#e\$f\textasciitilde{}g\textasciicircum{}h\textbackslash{}i\{j\}"
        r"\textbar{}\textless{}k\textgreater{}"
    )
    assert lines[2] == rf"half d & {escaped} & helix & overall \\"
    assert lines[4].startswith(f"{escaped} & ")
    assert lines[5].startswith(r"{*}\{2\} é & ")
    plain = re.sub(r"\\[&%$#_{}]|\$\\infty\$", "", "\n".join(lines))  # without what is escaped
    assert not set("%$#_~^<>|") & set(plain)
    assert {row.count("&") for row in plain.splitlines() if row.endswith(r"\\")} == {3}
    depths = [plain[:end].count("{") - plain[:end].count("}") for end in range(len(plain) + 1)]
    assert min(depths) == depths[-1] == 0


HOSTILE = "a_b & 50% #1 $x ~^\\{}", '[x] *y* |z|, "q" <i>', "*new\nline--é`_u_"


@pytest.fixture
def hostile(benchmark_of, tmp_path):
    """Patterns of a benchmark whose systems have such names, one of them no UTF-8."""
    systems = {str(number): (0.1 * number + 0.05, 1.0, 1, 0.0) for number in range(4)}
    found = benchmark_of(systems, ["car"], runs=2, n=40)
    for number, name in enumerate([*HOSTILE, os.fsdecode(b"n\xff")]):
        (tmp_path / "car" / str(number)).rename(tmp_path / "car" / name)
    (tmp_path / "car").rename(tmp_path / "[c]%_1|2")
    return found


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="needs pdflatex")
@pytest.mark.parametrize("by", ["PAS", "half_distance", "recall@5cm,5deg"])
def test_latex_of_any_names_compiles(hostile, run, tmp_path, by):
    metrics = ["--metrics", by] if "@" in by else []
    text = run(*hostile, "--latex", "--by", by, *metrics)[1]
    document = rf"\documentclass{{article}}\usepackage{{booktabs}}\begin{{document}}{text}"
    (tmp_path / "t.tex").write_text(document + r"\end{document}")
    command = ["pdflatex", "-halt-on-error", "t.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=60, check=False)
    assert done.returncode == 0, done.stdout.decode(errors="replace")[-500:]


def test_any_names_in_other_tables(hostile, run, tmp_path):
    rows = list(csv.DictReader(StringIO(run(*hostile, "--csv")[1], newline="")))
    assert {row["system"] for row in rows} == {*HOSTILE, r"n\udcff"}
    assert len(rows) == 2 * 4
    lines = run(*hostile, "--markdown")[1].split("\n\n")[1].splitlines()
    assert lines[0] == r"| PAS | \[c\]%\_1\|2 |"
    assert {len(re.findall(r"(?<!\\)\|", line)) for line in lines} == {3}
    assert any(line.startswith(r"| \*new\\nline--é\`\_u\_ |") for line in lines)
    found = json.loads(run(*hostile, "--json")[1])
    assert {one["system"] for one in found["systems"]} == {*HOSTILE, "n\udcff"}
    code, _, err = run(*hostile, "--html", "page.html")
    assert (code, err) == (0, "")
    assert (tmp_path / "page.html").read_text().count("</html>") == 1


YAML = """\
format: tum
reference: "{sequence}/gt.txt"
estimate: "{sequence}/{system}/{run}.txt"
runs: 3
sequences:
  car: {name: Car & co, unit: 0.5, t_offset: 0.0}
systems:
  a_b: {name: <A>, runs: 4}
"""


def test_yaml(patterns, run, compare, tmp_path):
    (tmp_path / "b.yaml").write_text(YAML)
    results = compare("b.yaml")["results"]
    missing = [(one["system"], one["run"]) for one in results if one["status"] == "missing"]
    assert missing == [("a_b", "3"), ("c", "2"), ("a_b", "3")]
    (tmp_path / "named.yaml").write_text(YAML.replace("runs: 4", "runs: [0, 1, 7]"))
    results = compare("named.yaml")["results"]
    missing = [(one["system"], one["run"]) for one in results if one["status"] == "missing"]
    assert missing == [("a_b", "7"), ("c", "2"), ("a_b", "7")]
    results = compare("b.yaml")["results"]
    units = {one["unit"] for one in results if one["sequence"] == "car"}
    assert units == {0.5, None}
    assert "Car & co" in run("b.yaml")[1]


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("format: tum", "format: bag", "format must be one of tum, "),
        ("runs: 3", "runs: 0", "runs must be a positive whole number or a list of names"),
        ("runs: 4", "speed: 4", "systems: a_b: unknown key 'speed'; known are name, "),
        ("unit: 0.5", "unit: small", "sequences: car: unit must be a positive number, not 'small'"),
        ("runs: 3", "runs: [", "cannot be read: "),
        ("reference:", "# reference:", "needs reference, a text"),
    ],
)
def test_wrong_yaml(run, tmp_path, old, new, reason):
    (tmp_path / "b.yaml").write_text(YAML.replace(old, new))
    code, out, err = run("b.yaml")
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "b.yaml" in err
    assert reason in err


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
    assert text.count("<svg") == 2 * 2 + 2 * 2  # drawings, and keys of two systems
    run("b.yaml", "--html", "again.html", "--no_cache", "--jobs", 1)
    assert (tmp_path / "again.html").read_text() == text


def test_page_sorts_and_fits_a_phone(patterns, run, tmp_path, browser):
    (tmp_path / "b.yaml").write_text(YAML)
    run("b.yaml", "--html", "page.html")
    html = (tmp_path / "page.html").read_text()
    (told,) = browser.run_at_widths(html, DRIVER, (390,)).values()
    assert told == ["<A>", "<A>", "c", "ascending", True]


SLIDERS = """
const text = (cell) => cell.textContent;
const rows = [...document.querySelectorAll("#scores tr")];
const scores = rows.map((row) => [...row.cells].slice(1).map((cell) => Number(text(cell))));
const names = rows.map((row) => text(row.cells[0]));
tell({ names, scores, setting: text(document.getElementById("setting")) });
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
    for system in SYSTEMS:
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


def test_trajectories_that_are_too_large_are_left_out(patterns, run, tmp_path, monkeypatch):
    monkeypatch.setattr("alignscores.compare.page.MOST", 0.01)
    run(*patterns, "--html", "page.html")
    text = (tmp_path / "page.html").read_text()
    assert own_pages(text) == {}
    assert " MB, more than 0.01 MB, and are left out. <code>alignscores FORMAT " in text
