"""The page to play with: what it holds, and in a browser what it computes, shows and remembers."""

import json
import re
from base64 import b64decode
from dataclasses import replace
from types import SimpleNamespace
from urllib.parse import parse_qs

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_hex

import report.explorer
import report.page
from alignscores import AlignmentScore
from alignscores.explorer import source
from alignscores.histogram import equal_steps
from experiments.camera_errors import FIRST, CameraErrors, measure, write_camera_errors
from experiments.config import Execution, experiment_names, load_sweep
from experiments.grid import cells
from experiments.metrics import order_statistic
from experiments.sweep import run_sweeps
from report.explorer import QUANTILES, TITLES, main, pack, render
from studies.head_to_head.rankings import compare_orders
from studies.order import order

HERE = Execution(n_jobs=1, backend="sequential", dask_address=None, results_dir="-")
TWO_BYTES = 0.002  # how far a rounded trial's score may be from that of the study
SMALL = {
    "outliers": ["n_cameras=[25]", "n_outliers=[0,5]", "sigma_t=[0.02,0.05,0.1]"],
    "trajectory_length": ["n_cameras=[10,20]", "sigma_t=[0.02,0.1]"],
    "rotations": ["n_cameras=[25]", "n_outliers=[0,3]", "sigma_r_deg=[1,5,9]"],
    "combined": ["n_cameras=[25]", "n_outliers=[4]", "sigma_t=[0.02,0.1]", "sigma_r_deg=[1,9]"],
    "maa_vs_pas_collinear": ["n_cameras=[25]", "n_outliers=[0,5]", "sigma_t=[0.05,0.02]"],
}
SMALL["maa_vs_pas_collinear"].append("sigma_r_deg=[5,1]")


def unpacked(packed):
    """Return the numbers behind the codes, as the page reads them."""
    codes = np.frombuffer(b64decode(packed["codes"]), dtype="<u2")
    low, high = packed["low"], packed["high"]
    values = low * (high / low) ** ((codes - 1.0) / 65533)
    return np.where(codes == 0, 0.0, np.where(codes == 65535, np.inf, values))


@pytest.fixture(scope="module")
def sweeps():
    named = ([f"experiment={name}", "trials=4", *own] for name, own in SMALL.items())
    return [load_sweep(overrides) for overrides in named]


@pytest.fixture(scope="module")
def errors(sweeps):
    return measure(sweeps, HERE)


@pytest.fixture(scope="module")
def html(errors):
    return render(errors)


def data_of(html):
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', html)
    return json.loads(text)


# ---- What it holds ------------------------------------------------------------------------------


def test_numbers_are_rounded_to_two_bytes_on_a_logarithmic_scale():
    rng = np.random.default_rng(0)
    values = np.concatenate([[0.0, np.inf], rng.lognormal(0, 3, size=5000)])
    read = unpacked(pack(values))
    np.testing.assert_array_equal(read[:2], values[:2])
    step = np.log(values[2:].max() / values[2:].min()) / 65533
    assert np.abs(np.log(read[2:] / values[2:])).max() <= 0.5001 * step
    np.testing.assert_allclose(np.sort(read)[1], np.sort(values)[1], rtol=1e-12)


@pytest.mark.parametrize("values", [[], [0.0], [np.inf], [0.7, 0.7], [0.0, 0.7, np.inf]])
def test_few_numbers_are_kept(values):
    values = np.array(values)
    np.testing.assert_allclose(unpacked(pack(values)), values, rtol=1e-12)


def test_codes_divide_the_range_evenly_and_the_ends_stand_beside_them():
    """A quarter of the way from 1 to 16 is 2; what is not finite has no part in the range."""
    packed = pack(np.array([0.0, 16.0, np.inf, 2.0, 1.0]))
    assert (packed["low"], packed["high"]) == (1.0, 16.0)
    codes = np.frombuffer(b64decode(packed["codes"]), dtype="<u2")
    assert codes.tolist() == [0, 65534, 65535, 1 + 16383, 1]
    assert pack(np.array([np.inf, 0.0])) == {"low": 1.0, "high": 1.0, "codes": "//8AAA=="}


def by_hand(overrides, name, positions, rotations):
    """Return errors of an experiment: 1, 2, 3, ..., and distances of 1, 2, 3, ... in each trial."""
    sweep = replace(load_sweep(overrides), name=name)
    counts = np.array([cell.n_cameras for cell in cells(sweep)]).repeat(sweep.trials)
    errors = np.arange(1.0, counts.sum() + 1)
    closest = np.concatenate([np.arange(1.0, count + 1) for count in counts])
    outliers = np.arange(len(counts))
    none = np.empty(0)
    return CameraErrors(
        sweep,
        errors if positions else none,
        2 * errors if rotations else none,
        closest if positions else none,
        outliers,
    )


def test_the_page_holds_all_of_its_experiments():
    """The one without a place in the paper comes last, under its own name."""
    combined = ["experiment=combined", "trials=2", "n_cameras=[4]", "n_outliers=[1]"]
    combined += ["sigma_t=[0.1,0.02]", "sigma_r_deg=[1,9]"]
    length = ["experiment=trajectory_length", "trials=1", "n_cameras=[20,10]", "sigma_t=[0.02]"]
    text = render([by_hand(length, "mine", True, False), by_hand(combined, "combined", True, True)])
    data = data_of(text)
    first, second = data.pop("experiments")
    paper = {"tas": 1.0, "ras": 10.0, "quantile": 0.75, "thresholds": 100, "weight": 0.5}
    assert data == {"paper": paper, "quantiles": QUANTILES}
    quantiles = [0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7]
    assert pytest.approx([*quantiles, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0]) == QUANTILES
    keys = "positions", "rotations", "units"
    numbers = [{key: unpacked(one.pop(key)) for key in keys} for one in (first, second)]
    for found, expected in zip(
        numbers,
        (
            {
                "positions": np.arange(1, 33),
                "rotations": 2 * np.arange(1, 33),
                "units": np.tile(np.repeat([1, 2, 3, 4], 5), 8),
            },
            {
                "positions": np.arange(1, 31),
                "rotations": [],
                "units": [*range(1, 21), *np.repeat(range(1, 11), 2)],
            },
        ),
        strict=True,
    ):
        for key in keys:
            np.testing.assert_allclose(found[key], expected[key], rtol=1e-4)

    def colours(name, *places):
        return [to_hex(colormaps[name](place)) for place in places]

    assert first == {
        "name": "combined",
        "figure": "Figure 6",
        "title": "Both noises",
        "about": ["cube", "cameras: 4", "outliers: 1"],
        "scores": ["TAS", "RAS", "PAS"],
        "trials": 2,
        "cameras": [4, 4, 4, 4],
        "outliers": [*range(8)],
        "levels": {"name": "σₜ", "labels": ["0.02", "0.1"], "worsens": "position noise"},
        "series": {
            "name": "σᵣ",
            "labels": ["1°", "9°"],
            "colours": colours("viridis", 0.0, 0.8),
            "worsens": "rotation noise",
        },
        "cells": [[0, 1], [1, 1], [0, 0], [1, 0]],
    }
    assert second == {
        "name": "mine",
        "figure": "",
        "title": "mine",
        "about": ["cube", "outliers: 0", "σᵣ: 3°"],
        "scores": ["TAS"],
        "trials": 1,
        "cameras": [20, 10],
        "outliers": [0, 1],
        "levels": {"name": "σₜ", "labels": ["0.02"], "worsens": "noise"},
        "series": {
            "name": "cameras",
            "labels": ["10", "20"],
            "colours": colours("YlGnBu_r", 0.0, 0.6),
            "worsens": "",
        },
        "cells": [[1, 0], [0, 0]],
    }
    assert "from the errors of 62 cameras." in text
    assert text.count(" 2 trials, hairlines ") == 1  # the most of any
    assert re.findall(r'value="(\w+)"( checked)?><span>(.*?)</span>', text)[:2] == [
        ("combined", " checked", "Both noises"),
        ("mine", "", "mine"),
    ]
    for part in ("style.css", "scores.js", "charts.js", "controls.js"):
        assert source(part) in text
    for part in ("explorer.css", "explorer.js"):
        assert report.page.own(part) in text
    title = "What if the threshold were another one? Alignment scores to play with"
    assert f"<title>{title}</title>" in text


@pytest.mark.parametrize(
    ("noise", "varied", "levels", "series"),
    [
        ("product", "", "sigma_t", "n_outliers"),
        ("product", "sigma_t", "sigma_t", "n_outliers"),
        ("product", "sigma_r_deg", "sigma_r_deg", "n_outliers"),
        ("product", "sigma_t sigma_r_deg", "sigma_t", "sigma_r_deg"),
        ("product", "n_cameras sigma_r_deg", "sigma_r_deg", "n_cameras"),
        ("product", "n_cameras", "sigma_t", "n_cameras"),
        ("paired", "", "sigma_t sigma_r_deg", "n_outliers"),
        ("paired", "n_cameras sigma_t sigma_r_deg", "sigma_t sigma_r_deg", "n_cameras"),
    ],
)
def test_one_setting_is_along_the_axis_and_another_tells_curves_apart(
    noise, varied, levels, series
):
    """Both kinds of noise are along the axis where they rise together."""
    names = "n_cameras", "n_outliers", "sigma_t", "sigma_r_deg"
    settings = {name: [1, 2] if name in varied.split() else [1] for name in names}
    sweep = SimpleNamespace(name="own", noise=noise, **settings)
    assert report.explorer._layout(sweep) == (tuple(levels.split()), series)


def test_a_trial_scores_in_the_paper_s_setting_as_in_the_study(sweeps, html):
    """From the rounded errors as the page holds them, for every trial of every experiment."""
    data = data_of(html)
    place = data["quantiles"].index(data["paper"]["quantile"])
    for shown in data["experiments"]:
        (sweep,) = [sweep for sweep in sweeps if sweep.name == shown["name"]]
        metrics = [name for name in ("TAS", "RAS", "PAS") if name in shown["scores"]]
        table = run_sweeps([replace(sweep, metrics=metrics)], HERE)
        positions, rotations = (unpacked(shown[key]) for key in ("positions", "rotations"))
        d = unpacked(shown["units"]).reshape(-1, len(data["quantiles"]))[:, place : place + 1]
        sizes = np.repeat(shown["cameras"], shown["trials"])
        starts = np.cumsum(sizes) - sizes
        assert len(table) == len(sizes)
        for k, row in enumerate(table.itertuples()):
            own = slice(starts[k], starts[k] + sizes[k])
            scores = {}
            if "TAS" in metrics:
                thresholds = d[k, 0] * equal_steps(1.0, 100, "_")
                scores["TAS"] = AlignmentScore(positions[own], thresholds).score
            if "RAS" in metrics:
                scores["RAS"] = AlignmentScore(rotations[own], equal_steps(10.0, 100, "_")).score
            if "PAS" in metrics:
                scores["PAS"] = (scores["TAS"] + scores["RAS"]) / 2
            for name in metrics:
                assert scores[name] == pytest.approx(getattr(row, name), abs=TWO_BYTES)


def test_curves_and_levels_rise_and_have_the_trials_of_their_cells(errors, html):
    for shown in data_of(html)["experiments"]:
        (own,) = [each for each in errors if each.sweep.name == shown["name"]]
        for (curve, level), cell in zip(shown["cells"], cells(own.sweep), strict=True):
            number = {"cameras": cell.n_cameras, "outliers": cell.n_outliers}
            number["σᵣ"] = f"{cell.sigma_r_deg:g}°"
            assert shown["series"]["labels"][curve] == str(number[shown["series"]["name"]])
            assert shown["levels"]["labels"][level] in (
                f"{cell.sigma_t:g}",
                f"{cell.sigma_r_deg:g}°",
                f"{cell.sigma_t:g}, {cell.sigma_r_deg:g}°",
            )
    (paired,) = [
        experiment
        for experiment in data_of(html)["experiments"]
        if "collinear" in experiment["name"]
    ]
    assert paired["levels"]["labels"] == ["0.02, 1°", "0.05, 5°"]  # given the other way round


def test_experiments_stand_in_the_paper_s_order(html):
    assert [experiment["name"] for experiment in data_of(html)["experiments"]] == list(SMALL)
    assert sorted(TITLES) == experiment_names()
    figures = [figure for figure, _ in TITLES.values()]
    assert figures == [f"Figure {number}" for number in ("2", "3", "4", "5", "6", "7a", "7b", "7c")]


def test_the_same_errors_give_the_same_bytes_and_no_network_is_needed(errors, html):
    assert render(list(reversed(errors))) == html
    assert set(re.findall(r"\w+://[^\"'\s<]+", html)) == {"http://www.w3.org/2000/svg"}
    assert "default-src 'none'" in html
    assert not re.search(r"<(link|img|iframe|script src)|@import|fetch\(|XMLHttp", html)


def test_the_paper_s_experiments_fit_in_three_megabytes():
    rng = np.random.default_rng(0)
    experiments = []
    for name in experiment_names():
        sweep = load_sweep([f"experiment={name}", f"trials={FIRST}"])
        empty = CameraErrors(sweep, *[np.empty(0)] * 3, np.empty(0, dtype=np.int64))
        size = FIRST * sum(empty.counts)
        wanted = set(sweep.metrics)
        positions = rng.random(size if wanted & {"TAS", "PAS"} else 0)
        rotations = rng.random(size if wanted & {"RAS", "PAS"} else 0)
        outliers = np.repeat([cell.n_outliers for cell in cells(sweep)], FIRST)
        experiments.append(CameraErrors(sweep, positions, rotations, positions, outliers))
    assert 2e6 < len(render(experiments).encode()) < 3e6


# ---- The program --------------------------------------------------------------------------------


def test_the_program_writes_the_page(errors, html, tmp_path, capsys):
    write_camera_errors(tmp_path / "errors.npz", errors)
    page = tmp_path / "new" / "explorer.html"
    assert main([str(tmp_path / "errors.npz"), "--output", str(page)]) == 0
    assert page.read_text(encoding="utf-8") == html
    assert capsys.readouterr().out == f"{page}\n"


def test_missing_errors_are_said_in_one_line(tmp_path, capsys):
    page = tmp_path / "explorer.html"
    assert main([str(tmp_path / "errors.npz"), "--output", str(page)]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("report.explorer: ")
    assert "errors.npz does not exist; run: snakemake" in line
    assert not page.exists()


def test_more_than_a_panel_can_show_is_refused(tmp_path, capsys):
    overrides = ["experiment=outliers", "trials=1", "n_cameras=[20,30]", "n_outliers=[0,2]"]
    write_camera_errors(tmp_path / "errors.npz", measure([load_sweep(overrides)], HERE))
    arguments = [str(tmp_path / "errors.npz"), "--output", str(tmp_path / "explorer.html")]
    assert main(arguments) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "outliers varies n_cameras and n_outliers; beside the noise a panel shows one" in line


# ---- In a browser -------------------------------------------------------------------------------

# What stands on the page, and what a reader does.
VIEW = """
const all = (selector) => [...document.querySelectorAll(selector)];
const each = (selector, value) =>
  Object.fromEntries(all(selector).map((one) => [one.id, value(one)]));
const texts = (row) => [...row.cells].map((cell) => cell.textContent);
const tables = (id) => all(`#${id} table`).map((one) => ({
  caption: one.caption.textContent,
  head: texts(one.tHead.rows[0]),
  rows: [...one.tBodies[0].rows].map(texts),
}));
const view = () => ({
  hash: location.hash,
  said: document.getElementById("said").textContent,
  scores: tables("scores-tables"),
  orders: tables("orders"),
  over: tables("order-tables"),
  profiles: tables("profile-tables"),
  outputs: each("output", (one) => one.textContent),
  sliders: each('input[type="range"]', (one) => one.value),
  checked: all(":checked").map((one) => one.value),
  shown: all(".sliders input, #outliers").filter((one) => one.offsetHeight).map((one) => one.id),
  lines: all(".line:not(.ghost)").length,
  ghosts: all(".ghost").length,
});
const later = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));
const move = (id, steps) => {
  const input = document.getElementById(id);
  input.value = Number(input.value) + steps;
  input.dispatchEvent(new Event("input", { bubbles: true }));
};
const choose = (value) => document.querySelector(`input[value="${value}"]`).click();
"""
LOOK = VIEW + "later(300).then(() => tell(view()));"


def scores_of(errors, name, *, unit, largest, thresholds, outliers="counted"):
    """Return the scores of all trials of an experiment: (curve cells in order, trials)."""
    values = errors.positions if name == "TAS" else errors.rotations
    sizes = np.repeat(errors.counts, errors.sweep.trials)
    trials = np.split(values, np.cumsum(sizes)[:-1])
    closest = np.split(errors.closest, np.cumsum(sizes)[:-1]) if unit else [None] * len(trials)
    found = []
    for own, near, k in zip(trials, closest, errors.outliers, strict=True):
        kept = own if outliers == "counted" else own[k:]
        failures = k if outliers == "failures" else 0
        counted = np.concatenate([kept, np.full(failures, np.inf)])
        d = order_statistic(near, unit) if unit else 1.0
        steps = d * equal_steps(largest, thresholds, "_")
        found.append(AlignmentScore(counted, steps).score)
    return np.reshape(found, (-1, errors.sweep.trials))


def by_name(errors, name):
    (own,) = [each for each in errors if each.sweep.name == name]
    return own


def numbers(table):
    """Return what a table says, without its row headers."""
    return np.array([[float(cell) for cell in row[1:]] for row in table["rows"]])


def assert_shows(table, expected):
    """A table of scores has the means of these trials, and their range."""
    curves = len(table["rows"])
    trials = expected.reshape(curves, len(table["head"]) - 3, -1)
    shown = numbers(table)
    np.testing.assert_allclose(shown[:, :-2], trials.mean(axis=2), atol=TWO_BYTES)
    np.testing.assert_allclose(shown[:, -2], trials.min(axis=(1, 2)), atol=TWO_BYTES)
    np.testing.assert_allclose(shown[:, -1], trials.max(axis=(1, 2)), atol=TWO_BYTES)


def test_it_opens_in_the_paper_s_setting(browser, html, errors):
    seen = browser.run(html, LOOK)
    (table,) = seen["scores"]
    paper = {"unit": 0.75, "largest": 1.0, "thresholds": 100}
    expected = scores_of(by_name(errors, "outliers"), "TAS", **paper)
    assert table["caption"].startswith("TAS")
    assert table["head"] == ["outliers", "0.02", "0.05", "0.1", "smallest", "largest"]
    assert_shows(table, expected)
    assert seen["ghosts"] == 0
    assert [name for name in seen["shown"] if name] == ["tas", "quantile", "thresholds", "outliers"]
    assert seen["checked"] == ["outliers", "counted"]
    assert seen["outputs"]["tas-value"] == "1 d"
    assert seen["said"].startswith("TAS up to 1 d, the paper’s setting: mean ")
    assert f"mean {expected.mean():.2f}" in seen["said"]
    assert seen["hash"] == ""


@pytest.mark.parametrize("outliers", ["counted", "failures", "ignored"])
def test_another_setting_gives_the_scores_that_python_computes(browser, html, errors, outliers):
    fragment = "#experiment=combined&tas=2.5&ras=4&quantile=0.3&thresholds=20&weight=0.2"
    seen = browser.run(html, LOOK, f"{fragment}&outliers={outliers}")
    own = by_name(errors, "combined")
    chosen = {"thresholds": 20, "outliers": outliers}
    tas = scores_of(own, "TAS", unit=0.3, largest=2.5, **chosen)
    ras = scores_of(own, "RAS", unit=0, largest=4.0, **chosen)
    order_of_cells = np.array([[0, 2], [1, 3]]).ravel()  # curves are those of the rotation noise
    for table, expected in zip(seen["scores"], (tas, ras, 0.2 * tas + 0.8 * ras), strict=True):
        assert_shows(table, expected[order_of_cells])
    assert seen["ghosts"] == 3 * 2
    said = "PAS up to 2.5 d (d the 30 % quantile) and 4°, 20 thresholds, weight 0.2"
    more = {"failures": ", outliers as failures", "ignored": ", without the outliers"}
    assert seen["said"].startswith(f"{said}{more.get(outliers, '')}: mean ")


def test_the_orders_are_those_of_the_study(browser, html, sweeps):
    """By the program that makes the study's table, of the same trials."""
    for name in ("outliers", "combined", "rotations"):
        seen = browser.run(html, LOOK, f"#experiment={name}")
        (sweep,) = [sweep for sweep in sweeps if sweep.name == name]
        scores = [score["caption"][:3] for score in seen["scores"]]
        sweep = replace(sweep, metrics=scores)
        trials = Trial(run_sweeps([sweep], HERE), sweep)
        table = compare_orders({name: trials})
        alone = table[table["versus"].isna()].set_index(["metric", "level"])["order"]
        (shown,) = seen["orders"]
        found = {}
        for score, level, now, paper, _ in shown["rows"]:
            assert now == paper
            found[score, level.removeprefix("position ")] = float(now.removesuffix(" %"))
        assert set(found) == set(alone.index)
        for key, value in found.items():
            assert value == pytest.approx(alone[key], abs=1.0), key  # ties may be rounded away


class Trial:
    """What `compare_orders` takes of trials."""

    def __init__(self, table, sweep):
        self.table, self.sweep = table, sweep


def test_the_order_over_thresholds_passes_through_that_of_the_setting(browser, html, errors):
    seen = browser.run(html, LOOK, "#experiment=outliers&thresholds=50")
    (table,) = seen["over"]
    own = by_name(errors, "outliers")
    assert table["head"] == ["d", "noise", "outliers"]
    for text, *orders in table["rows"]:
        tas = scores_of(own, "TAS", unit=0.75, largest=float(text), thresholds=50).reshape(2, 3, 4)
        noise = np.mean([order(list(-curve)).probability for curve in tas])
        outliers = np.mean([order(list(-level)).probability for level in tas.swapaxes(0, 1)])
        for shown, expected in zip(orders, (noise, outliers), strict=True):
            assert float(shown.removesuffix(" %")) == pytest.approx(100 * expected, abs=2.0)


@pytest.mark.parametrize(("experiment", "score"), [("rotations", "RAS"), ("outliers", "TAS")])
def test_profiles_are_the_scores_over_thresholds_and_cross_one_half_where_they_say(
    browser, html, errors, experiment, score
):
    seen = browser.run(html, LOOK, f"#experiment={experiment}&level=2")
    (table,) = seen["profiles"]
    own = by_name(errors, experiment)

    def at(largest):
        quantile = 0.75 if score == "TAS" else 0
        found = scores_of(own, score, unit=quantile, largest=largest, thresholds=100)
        return found.reshape(2, 3, 4)[:, 1]  # curves at the second of three levels

    assert ("σᵣ 5°" if score == "RAS" else "σₜ 0.05") in table["caption"]
    unit = " °" if score == "RAS" else " d"
    for k, text in enumerate(table["head"][2:]):
        shown = [float(row[2 + k]) for row in table["rows"]]
        expected = at(float(text.removesuffix(unit))).mean(axis=1)
        np.testing.assert_allclose(shown, expected, atol=TWO_BYTES)
    for curve, row in enumerate(table["rows"]):
        half = float(row[1].removesuffix(unit))
        before, after = ((at(factor * half)[curve] >= 0.5).sum() for factor in (0.99, 1.01))
        assert before < 2 <= after  # of four trials the second reaches one half there


def test_a_moved_slider_stands_in_the_address_and_the_address_gives_the_same_view(browser, html):
    moves = """
    choose("combined"); move("tas", 7); move("ras", -9); move("quantile", -5);
    move("thresholds", 9); move("weight", 3); choose("failures"); move("level", 1);
    later(600).then(() => tell(view()));
    """
    moved = browser.run(html, VIEW + moves)
    parts = {key: one for key, (one,) in parse_qs(moved["hash"].removeprefix("#")).items()}
    assert parts["experiment"] == "combined"
    assert parts["thresholds"] == "Infinity"
    assert parts["outliers"] == "failures"
    assert set(parts) == {"experiment", "tas", "ras", "quantile", "thresholds", "weight"} | {
        "outliers",
        "level",
    }
    assert moved["outputs"]["thresholds-value"] == "∞"
    assert browser.run(html, LOOK, moved["hash"]) == moved

    followed = "location.hash = HASH; later(600).then(() => tell(view()));"
    followed = followed.replace("HASH", json.dumps(moved["hash"]))
    assert browser.run(html, VIEW + followed, "#experiment=rotations&ras=3") == moved


def test_one_click_leads_back_to_the_paper(browser, html):
    back = """
    move("tas", 5); move("thresholds", -1); choose("ignored");
    later(300).then(() => document.getElementById("reset").click());
    later(900).then(() => tell(view()));
    """
    seen = browser.run(html, VIEW + back)
    assert seen == browser.run(html, LOOK) | {"hash": seen["hash"]}
    assert seen["hash"] in ("", "#")


@pytest.mark.parametrize(
    "fragment",
    [
        "#experiment=nothing&tas=-1&ras=x&quantile=0.33&thresholds=2.5&weight=7&outliers=no",
        "#tas=&level=-3&__proto__=1&quantile=Infinity",
        "#scores",
        "#level=99",
    ],
)
def test_a_wrong_address_is_the_paper_s_setting(browser, html, fragment):
    wrong, right = browser.run(html, LOOK, fragment), browser.run(html, LOOK)
    assert wrong | {"hash": ""} == right


def test_what_an_experiment_has_not_cannot_depart_from_the_paper(browser, html):
    seen = browser.run(html, LOOK, "#experiment=trajectory_length&ras=3&weight=1&outliers=ignored")
    assert seen["ghosts"] == 0
    assert seen["said"].startswith("TAS up to 1 d, the paper’s setting: mean ")
    assert "outliers" not in seen["shown"]


def test_a_link_within_the_page_changes_no_setting(browser, html):
    script = """
    move("tas", 5);
    document.querySelector(".skip").click();
    later(600).then(() => tell(view()));
    """
    seen = browser.run(html, VIEW + script)
    assert seen["outputs"]["tas-value"] != "1 d"
    assert seen["ghosts"] == 2


def test_charts_are_read_with_the_arrow_keys(browser, html):
    script = """
    later(300).then(() => {
      const reader = document.querySelector("#panels .reader");
      const value = (name) => reader.getAttribute(name);
      const read = (key) => {
        reader.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
        return [value("aria-valuenow"), value("aria-valuetext")];
      };
      tell({
        found: ["ArrowRight", "ArrowRight", "End", "ArrowRight", "Home"].map(read),
        role: value("role"), tab: reader.tabIndex, name: value("aria-label"),
        shown: document.querySelector("#panels .readout").textContent, view: view(),
      });
    });
    """
    seen = browser.run(html, VIEW + script)
    assert (seen["role"], seen["tab"], seen["name"]) == ("slider", 0, "Read the TAS")
    assert [place for place, _ in seen["found"]] == ["0", "1", "2", "2", "0"]
    assert seen["shown"] == seen["found"][-1][1]
    rows = seen["view"]["scores"][0]["rows"]
    text = f"σₜ 0.05: 0: {rows[0][2]}, 5: {rows[1][2]} (by outliers)"
    assert seen["found"][1][1] == text


def test_everything_has_a_name_and_rest_is_spoken(browser, html):
    script = """
    const inputs = all("input, button, select");
    const named = (one) => one.labels?.[0]?.textContent.trim() || one.textContent.trim();
    const spoken = document.getElementById("spoken");
    const values = (selector, name) => all(selector).map((one) => one.getAttribute(name));
    const ids = values("[id]", "id");
    let early;
    later(300).then(() => { move("tas", 1); });
    later(500).then(() => { early = spoken.textContent; });
    later(2000).then(() => tell({
      inputs: inputs.length, nameless: inputs.filter((one) => !named(one)).length,
      charts: values("svg.chart", "aria-label"), twice: ids.length - new Set(ids).size,
      role: spoken.getAttribute("role"), early, late: spoken.textContent, said: view().said,
      links: values("a", "href"), texts: values('input[type="range"]', "aria-valuetext"),
    }));
    """
    seen = browser.run(html, VIEW + script)
    assert seen["inputs"] == 5 + 3 + 6 + 1  # experiments, outliers, sliders, a button
    assert seen["nameless"] == seen["twice"] == 0
    assert len(seen["charts"]) == 3
    assert all(seen["charts"])
    assert all(seen["texts"])
    assert seen["role"] == "status"
    assert seen["early"] != seen["late"] == seen["said"]
    assert seen["links"] == ["#scores", "report.html"]


WIDTHS = """
document.querySelectorAll("details").forEach((each) => { each.open = true; });
setTimeout(() => {
  const charts = [...document.querySelectorAll("svg.chart")];
  tell({
    scroll: document.documentElement.scrollWidth,
    inner: innerWidth,
    charts: charts.map((one) => one.getBoundingClientRect().width),
  });
}, 300);
"""


@pytest.mark.parametrize("experiment", ["maa_vs_pas_collinear", "outliers"])
def test_it_is_no_wider_than_its_screen(browser, html, experiment):
    shown = html.replace(
        "const { change, defaults: PAPER, state } = kept;",
        f"""const {{ change, defaults: PAPER, state }} = kept;
  state.experiment = "{experiment}";""",
    )
    assert shown != html
    for width, page in browser.run_at_widths(shown, WIDTHS, (320, 390, 620, 1030, 1300)).items():
        assert page["inner"] >= width - 20  # but for a scroll bar
        assert page["scroll"] <= page["inner"], width
        assert page["charts"]
        assert all(200 <= chart <= width for chart in page["charts"])


def test_a_single_curve_or_level_is_shown_without_an_order(browser):
    overrides = ["experiment=outliers", "trials=1", "n_cameras=[20]", "n_outliers=[0]"]
    sweep = load_sweep([*overrides, "sigma_t=[0.05]"])
    seen = browser.run(render(measure([sweep], HERE)), LOOK)
    assert seen["orders"][0]["rows"] == []
    assert seen["lines"] == 2  # score and profile
    assert "right order" not in seen["said"]
