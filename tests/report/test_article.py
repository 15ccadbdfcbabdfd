"""The article: its numbers are those of the results, and it says nothing that these do not."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import report.article
import report.page
import report.results
from report.__main__ import main
from report.article import FOLDER, TEMPLATE
from report.estimates import Estimate
from studies.claims.claims import load_claims

from .conftest import REPLICATES, TRIALS, Page, Results

# What is no result, and why it may be typed.
SETTINGS = {
    "10°": "largest threshold of RAS and mAA",
    "100": "thresholds of a score",
    "1000": "hypotheses of the registration",
    "4": "least m",
    "99": "in the name PCR-99",
    "1": "in the names Table 1, L1 and Median-1",
    "2": "in the names L2 and RMS-2",
    "50": "outliers of the captions",
    "40": "cameras up to which m is 4",
    "00": "in the name KITTI 00",
}
# In what is printed or set: a name, a setting, how many digits are shown, a place in a list, a
# share as a percentage, a plural.
HARMLESS = (
    r"fixed\(\"[^\"]*\"\)",
    r"\"%\.3g\"",
    r"[\"'][A-Za-z][\w-]*[\"']|[\"'][^\"'\d]*[\"']",
    r"number\(\d\)|(?<=order), \d\)",
    r"\[:?\d+\]|\) \+ 1$",
    r"100 \* \(?(1 - missed|central)",
    r"== 1\b",
)


REFINED, QUARTER = "TAS(registration=refined)", "HalfDistance(score=0.25)"


def typed_numbers(template):
    """Numbers of a template that are neither of the results nor marked as settings."""
    references = template.partition("{% set references")[2].partition("%}")[0]
    text = re.sub(r"\{#.*?#\}", "", template.replace(references, ""), flags=re.DOTALL)
    code = re.findall(r"\{\{(.*?)\}\}|\{% set (.*?)%\}", text, flags=re.DOTALL)
    text = re.sub(r"\{[{%].*?[}%]\}", "", text, flags=re.DOTALL)
    found = re.findall(r"\w*\d[\w.,]*", re.sub(r"<[^>]*>|&#?\w+;", " ", text))
    for part in ("".join(parts).strip() for parts in code):
        found += re.findall(r"(?<!\w)\d[\d.]*", re.sub("|".join(HARMLESS), "", part))
    return found


@pytest.fixture(scope="module")
def made(original, tmp_path_factory):
    """The made-up results with all that the article names, and a number of its own."""
    folder = shutil.copytree(original.folder, tmp_path_factory.mktemp("article") / "results")
    made = Results(folder)
    orders = pd.read_csv(folder / "tables/head_to_head.csv")
    first, pair = orders.head(1), orders.tail(1)
    refined, quarter = (
        first.assign(metric=REFINED, order=85),
        first.assign(metric=QUARTER, order=88),
    )
    pairs = pair.assign(metric=REFINED, versus="TAS"), pair.assign(metric=REFINED, versus=QUARTER)
    others = [pair.assign(metric="mAA", versus=versus) for versus in (REFINED, QUARTER)]
    others.append(pair.assign(metric="TAS", versus=QUARTER))
    orders = pd.concat([orders, refined, quarter, *pairs, *others])
    ate = orders.head(1).assign(metric="ATE", order=60, low=59, high=61, trials=np.inf)
    others = [
        orders.assign(experiment=experiment, level=level)
        for experiment, level in (
            ("outliers", "outliers"),
            ("collinear", "noise"),
            ("collinear", "outliers"),
        )
    ]
    pairs = tuple(pair.assign(metric=metric, versus="ATE") for metric in ("mAA", "TAS"))
    pd.concat([orders, ate, *pairs, *others]).to_csv(
        folder / "tables/head_to_head.csv", index=False
    )
    rates = pd.read_csv(folder / "tables/frame_rate.csv")
    half = rates.assign(metric="HalfDistance", dependence=5, order=95, order_across=90)
    aligned = rates.assign(metric=REFINED)
    pd.concat([rates, aligned, half]).to_csv(folder / "tables/frame_rate.csv", index=False)
    with made.table("claims.csv") as table:
        row = table["id"] == "outliers-range-tas"
        table.loc[row, ["ours", "low", "high"]] = -51.5, -53.1, -49.2
    return made


@pytest.fixture(scope="module")
def article(made):
    """The article of these results."""
    path = made.folder / "article.html"
    assert main([*made.arguments("--article"), "--output", str(path)]) == 0
    return Page(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def found(made):
    """What any template is filled with."""
    return report.page.contents(report.results.Results(made.folder, made.settings))


@pytest.fixture
def write(made, found, capsys, monkeypatch, tmp_path):
    """Write the article; return the exit code, what was said, and the page."""

    def contents(*_):
        return found | {"paper_trials": report.page.PAPER_TRIALS}

    def run():
        path = tmp_path / "article.html"
        with monkeypatch.context() as patch:
            patch.setattr(report.article, "contents", contents)
            code = main([*made.arguments("--article"), "--output", str(path)])
        page = Page(path.read_text(encoding="utf-8")) if code == 0 else None
        return code, capsys.readouterr().err, page

    return run


@pytest.fixture
def whole_study(monkeypatch):
    """Take the made-up results for those of as many trials and replicates as there should be."""
    claims = replace(load_claims(), replicates=REPLICATES)
    monkeypatch.setattr(report.article, "load_claims", lambda: claims)
    monkeypatch.setattr(report.page, "PAPER_TRIALS", TRIALS)


@pytest.fixture
def template(monkeypatch, tmp_path):
    """Write another template."""
    folder = shutil.copytree(FOLDER, tmp_path / "article")
    monkeypatch.setattr(report.article, "FOLDER", folder)
    return folder / TEMPLATE


def rows_of(page, name):
    (caption,) = [
        element for element in page.all("caption") if element.get("id") == f"table-{name}"
    ]
    table = next(element for element in reversed(caption.parents) if element.tag == "table")
    return [
        [cell.text for cell in page.within(row, "th", "td")]
        for row in page.within(table, "tr")
        if not any(parent.tag == "thead" for parent in row.parents)
    ]


def number(text):
    return float(text.replace("−", "-").replace("+", "").split("\u202f")[0].split()[0])


def test_no_result_is_typed():
    text = (FOLDER / TEMPLATE).read_text(encoding="utf-8")
    assert typed_numbers(text) == []
    assert set(re.findall(r"fixed\(\"([^\"]*)\"\)", text)) == set(SETTINGS)


@pytest.mark.parametrize(
    "text",
    [
        "<p>The TAS has 87.3 %.</p>",
        "<p>{{ trials }} and 20 replicates</p>",
        '<p>{{ "87.3 %" }}</p>',
        '<p>{{ "about 87.3 %" }}</p>',
        "<p>{{ 0.75 | number(2) }}</p>",
        '<p>{{ claim("a").mean if x else 12.5 }}</p>',
        "{% set share = 12.5 %}",
        "<p>Median-1</p>",
    ],
)
def test_a_result_that_is_typed_is_found(text):
    assert typed_numbers(text) != []


def test_the_numbers_are_those_of_the_results(article, made):
    table = pd.read_csv(made.folder / "claims.csv").set_index("id")
    claims = load_claims().claims
    numeric = [name for name, claim in claims.items() if claim.paper is not None]
    shown = rows_of(article, "numbers")
    assert len(shown) == len(numeric) == 14
    for name, (source, _, paper, ours, interval, mean, pooled, verdict, truth) in zip(
        numeric, shown, strict=True
    ):
        row = table.loc[name]
        assert source == claims[name].source
        assert number(paper) == claims[name].paper
        assert number(ours) == pytest.approx(row["ours"], abs=0.051)
        assert number(pooled) == pytest.approx(row["pooled"], abs=0.051)
        for text, bounds in ((interval, ("low", "high")), (mean, ("mean_low", "mean_high"))):
            found = [number(part) for part in text.strip("[]").split(", ")]
            assert found == pytest.approx(list(row[[*bounds]]), abs=0.051)
        assert (verdict, truth) == (row["verdict"], row["population"])
    assert "−51.5" in article.html


def test_verdicts_are_counted(article, made):
    table = pd.read_csv(made.folder / "claims.csv")
    counted = table[table["implied_by"].isna()]
    *rows, (_, *total) = rows_of(article, "verdicts")
    verdicts = counted["verdict"].value_counts()
    truths = counted["population"].value_counts()
    words = ("reproduced", "inconclusive", "not reproduced")
    expected = [len(counted), *(verdicts[word] for word in words)]
    expected += [truths[word] for word in ("true", "open", "false")]
    assert [int(cell) for cell in total] == expected
    assert [row[0] for row in rows] == list(counted["source"].unique())
    columns = zip(*(map(int, row[1:]) for row in rows), strict=True)
    assert [sum(column) for column in columns] == expected
    exceptions = rows_of(article, "exceptions")
    assert len(exceptions) == len(counted) - verdicts["reproduced"]
    statements = set(counted.loc[counted["verdict"] != "reproduced", "statement"])
    assert {row[0] for row in exceptions} == statements


def test_other_tables_are_shown_as_they_are(article, made):
    rates = rows_of(article, "rates")
    assert rates == [
        ["TAS", "40 to 60", *["91 / 57"] * 4],
        ["TAS refined", "40 to 60", *["91 / 57"] * 4],
        ["HalfDistance", "5 to 5", *["95 / 90"] * 4],
    ]
    first, *others = rows_of(article, "order")
    four = "mAA 90.0 > QuarterDistance 88.0 > TAS refined 85.0 > TAS 80.0"
    assert first == ["outliers", "noise", f"{four} > ATE 60.0"]
    assert [row[2] for row in others] == 3 * [four]
    table = pd.read_csv(made.folder / "tables/method_comparison.csv")
    brackets = sum(cell.count("[") for row in rows_of(article, "properties") for cell in row)
    assert brackets == (table["agrees"] == "no").sum()


@pytest.mark.parametrize("experiment", ["lines", "planes"])
@pytest.mark.parametrize("level", ["noise", "outliers"])
@pytest.mark.parametrize(("pair", "sign"), [(("TAS", "ATE"), 1), (("ATE", "TAS"), -1)])
def test_metrics_are_compared_in_one_experiment_by_one_level(experiment, level, pair, sign):
    rows = [
        {"experiment": where, "level": what, "metric": "TAS", "versus": "ATE", "order": number}
        for number, (where, what) in enumerate(product(("lines", "planes"), ("noise", "outliers")))
    ]
    order = pd.DataFrame(rows).assign(low=-9.0, high=10.0, p=0.01)
    (expected,) = order.query("experiment == @experiment and level == @level")["order"]
    found = report.article._comparisons(order)[experiment, level, *pair]
    assert found["order"] == sign * expected
    assert (found["low"], found["high"]) == ((-9, 10) if sign == 1 else (-10, 9))


@pytest.mark.parametrize(
    ("order", "p", "first", "second"),
    [
        (0.5, 0.049, True, False),
        (0.5, 0.05, False, False),  # as likely as in one of twenty
        (0.5, None, False, False),
        (0.0, 0.01, False, False),
        (-0.5, 0.049, False, True),
    ],
)
def test_a_metric_that_orders_more_is_certain_to_where_chance_hardly_does(order, p, first, second):
    key = {"experiment": "lines", "level": "noise"}
    pair = {"metric": "TAS", "versus": "ATE", "order": order, "low": -2, "high": 3, "p": p}
    alone = {"metric": "TAS", "versus": None, "order": 80, "low": 79, "high": 81, "p": None}
    found = report.article._comparisons(pd.DataFrame([key | pair, key | alone]))
    is_certain = {pair[2:]: one["is_certain"] for pair, one in found.items()}
    assert is_certain == {("TAS", "ATE"): first, ("ATE", "TAS"): second}


def test_what_captions_say_stands_beside_what_came_out(article, made):
    table = pd.read_csv(made.folder / "claims.csv").set_index("id")
    worded = {
        name: claim
        for name, claim in load_claims().claims.items()
        if claim.source.startswith(("Figure 5", "Figure 6", "Figure 7"))
        if claim.paper is None and not claim.implied_by
    }
    shown = rows_of(article, "captions")
    counts = [
        int(row[1].split()[1]) if "others" in row[1] else row[1].count(",") + 1 for row in shown
    ]
    assert sum(counts) == len(worded)
    weaker = [name for name in worded if re.fullmatch("rotations-.*-below-ras-noise", name)]
    (row,) = [row for row in shown if "it discerns the noise level less well" in row[2]]
    assert row[:2] == ["Figure 5", f"the {len(weaker)} others"]
    ends = [f"{end:+.3f}" for end in table.loc[weaker, "ours"].agg(["min", "max"])]
    assert row[4] == f"{' to '.join(ends)} τ"
    held = (table.loc[weaker, "verdict"] == "reproduced").sum()
    assert row[5] == f"{held} of {len(weaker)}"
    (row,) = [row for row in shown if row[2].startswith("It does so by the rotations, whose")]
    assert row[5] == table.loc["line-maa-by-rotations", "verdict"]


def test_authors_would_be_asked_about_each_statement_that_is_in_doubt(article, made):
    table = pd.read_csv(made.folder / "claims.csv")
    doubted = table[table["implied_by"].isna() & (table["verdict"] != "reproduced")]
    asked = [
        [int(count) for count in re.findall(r"\((\d+) of these statements\.\)", item.text)]
        for item in article.all("li")
        if item.text.endswith("statements.)")
    ]
    below = doubted["id"].str.fullmatch("rotations-.*-below-ras-outliers").sum()
    much = doubted["id"].str.contains("-much-|-especially").sum()
    assert [below] in asked
    assert [much] in asked


def test_other_criteria_and_costs_are_shown(article, made):
    criteria = pd.read_csv(made.folder / "tables/criteria.csv").fillna("–")
    rows = rows_of(article, "criteria")
    assert [row[:5] + row[6:] for row in rows] == [
        [row.word, f"{row.bound:g}", f"{row.other:g}", "9", str(row.changed), row.changes]
        for row in criteria.itertuples()
    ]
    costs = {row[0]: row[1:] for row in rows_of(article, "costs")}
    assert list(costs) == ["claims", "all"]
    assert costs["all"] == ["3", "2 min 33 s", "52.0 s", "–", "100 MB"]


def test_real_runs_are_shown_where_there_are_any(article, made, tmp_path):
    (missing,) = [element.text for element in article.all("p") if "no real" in element.text]
    assert "docs/explanation/real.md" in missing
    assert "All data are simulated" in article.html
    folder = shutil.copytree(made.folder, tmp_path / "results")
    real = Results(folder, (*made.settings, "benchmark=mine.yaml"))
    row = {"runs": np.inf, "told": 50, "order": 75, "agrees": 60, "between": 20}
    tables = (
        pd.DataFrame([{"metric": "TAS", **row}]),
        pd.DataFrame(
            [{"metric": "TAS", "sequence": "desk", "a": "orb", "b": "dso", "better": "orb"}]
        ).assign(order=75, told=True, runs=9),
        pd.DataFrame([{"metric": "TAS", "other": "TAS", "agrees": 60, "correlation": 1}]),
    )
    for name, table in zip(("real", "real_pairs", "real_agreement"), tables, strict=True):
        real.write(f"tables/{name}.csv", table)
    shutil.copy(folder / "figures/outliers.png", folder / "figures/real.png")
    real.write("benchmarks/real/desk.tsv", "s\tcpu_time\tmax_rss\n4.0\t2.5\t90.0\n")
    path = tmp_path / "article.html"
    assert main([*real.arguments("--article"), "--output", str(path)]) == 0
    page = Page(path.read_text(encoding="utf-8"))
    assert ["real", "1", "4.0 s", "4.0 s", "2.5 s", "90 MB"] in rows_of(page, "costs")
    assert rows_of(page, "real") == [["TAS", "∞", "50", "75", "60"]]
    assert "dso, orb on 1 sequence." in page.html
    assert "All data but those of the real runs" in page.html


def test_a_quick_look_says_so_and_leaves_out_what_does_not_hold(write):
    code, error, page = write()
    assert (code, error) == (0, "")
    (note,) = [element.text for element in page.all("p") if element.get("class") == "quick"]
    assert f"{TRIALS} trials in each cell and {REPLICATES} replicates" in note
    assert "snakemake report --config trials=7" in note
    left_out = [element for element in page.all("span") if element.get("class") == "left-out"]
    assert left_out
    assert "Between frame rates the TAS orders estimates far worse" in page.html
    assert page.html.count("On a line it is the other way round") == 0


@pytest.mark.usefixtures("whole_study")
def test_a_whole_study_is_refused_where_the_text_says_what_it_does_not(write):
    code, error, _ = write()
    assert code == 1
    assert re.fullmatch(r"report: .*article\.html\.j2 says what the results do not: .*\n", error)


def test_the_range_of_a_metric_without_a_mean_is_undefined(found):
    row = found["counted"][0]
    assert report.article._means([row, replace(row, mean=np.nan)]) == "undefined"


@pytest.mark.usefixtures("whole_study")
@pytest.mark.parametrize(
    "setting", ["trials=", "replicates=", "benchmark=", "quick=", "more=", "seed="]
)
def test_a_study_is_whole_with_settings_that_leave_it_as_it_is(
    made, found, template, monkeypatch, setting
):
    numbers = found | {"paper_trials": report.page.PAPER_TRIALS}
    monkeypatch.setattr(report.article, "contents", lambda *_: numbers)
    template.write_text("{{ is_quick }}")
    assert report.article.render(replace(made, settings=[f"{setting}1"])) == str(setting == "seed=")


@pytest.mark.parametrize(
    ("trials", "replicates", "settings", "is_quick"),
    [
        (50, 20, [], False),
        (51, 21, ["trials=51", "replicates=21"], False),
        (49, 20, [], True),
        (50, 19, [], True),
        (50, 20, ["seed=1", "trials=50"], True),
        (50, 20, ["trials=50", "seed=1"], True),
    ],
)
def test_fewer_trials_or_replicates_make_a_quick_look(
    made, found, template, monkeypatch, trials, replicates, settings, is_quick
):
    numbers = {"replicate": replace(found["replicate"], trials=trials), "paper_trials": 50}
    numbers = found | numbers | {"n_replicates": replicates}
    claims = replace(load_claims(), replicates=20)
    monkeypatch.setattr(report.article, "contents", lambda *_: numbers)
    monkeypatch.setattr(report.article, "load_claims", lambda: claims)
    template.write_text("{{ is_quick }}\n")
    given = replace(made, settings=settings)
    assert report.article.render(given) == f"{is_quick}\n"


def test_templates_have_names_for_metrics_and_words(write, template, found):
    """Claims are in doubt whose whole name fits a pattern."""
    names = [row.claim.id for row in found["exceptions"]]
    template.write_text(
        "<p>{{ refined }} {{ quarter }} {{ least_power }} {{ fixed('10°') }}</p>"
        "<p>{{ [] | listed }}; {{ ['a', 'b', 'c'] | listed }}</p>"
        "<p>{% for one in doubted('outliers-.*') %}{{ one.claim.id }} {% endfor %}</p>"
        "<p>{{ doubted('outliers') | length }}</p>"
    )
    code, error, page = write()
    assert (code, error) == (0, "")
    assert [element.text for element in page.all("p")] == [
        f"{REFINED} {QUARTER} 0.5 10°",
        "none; a, b and c",
        " ".join(name for name in names if name.startswith("outliers-")),
        "0",
    ]


@pytest.mark.usefixtures("whole_study")
@pytest.mark.parametrize(("condition", "expected"), [("", 0), ("not ", 1)])
def test_a_sentence_stands_where_its_condition_holds(write, template, condition, expected):
    holds = f'{condition}at_rates("TAS").order_across == 57'
    template.write_text(f"<p>{{% call says({holds}) %}}It is so.{{% endcall %}}</p>")
    code, error, page = write()
    assert code == expected
    if expected:
        assert error.endswith("says what the results do not: 'It is so.'; write what they do\n")
    else:
        assert page.html == "<p>It is so.</p>"


@pytest.mark.usefixtures("whole_study")
def test_a_changed_setting_makes_no_whole_study(write, template, make_results):
    template.write_text("{% call says(False) %}It is so.{% endcall %}")
    assert write()[0] == 1
    other = make_results("pas_weight=[0.2]")
    assert main(other.arguments("--article")) == 0


def test_a_metric_is_compared_from_either_side(write, template):
    pairs = ('"mAA", "TAS"', '"TAS", "mAA"')
    parts = [f'{{% set one = ahead("outliers", "noise", {pair}) %}}' for pair in pairs]
    line = "<p>{{ one.order }} {{ one.low }} {{ one.high }} {{ one.is_certain }}</p>"
    template.write_text(line.join([*parts, ""]))
    _, _, page = write()
    texts = [element.text for element in page.all("p")]
    assert texts == ["10.0 9.0 11.0 True", "-10.0 -11.0 -9.0 False"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{{ claim("outliers-nothing") }}', "asks for no claim: outliers-nothing"),
        ('{{ picture("nothing") }}', "asks for no figure: nothing"),
        ('{{ place("outliers", "noise", "XYZ") }}', "asks for no order: outliers noise XYZ"),
        ('{{ at_rates("XYZ") }}', "asks for no frame rate of: XYZ"),
        (
            '{{ ahead("outliers", "noise", "a", "b") }}',
            "asks for no comparison: outliers noise a b",
        ),
        ("{{ nothing }}", "'nothing' is undefined"),
        ("{{ replicate.nothing }}", "has no attribute 'nothing'"),
        ("{% if %}", "Expected an expression"),
    ],
)
def test_what_there_is_not_is_named(write, template, text, message):
    template.write_text(text)
    code, error, _ = write()
    assert code == 1
    assert message in error
    assert error.count("\n") == 1


def test_a_table_that_is_missing_is_named(results, capsys):
    (results.folder / "tables/head_to_head.csv").unlink()
    assert main(results.arguments("--article")) == 1
    error = capsys.readouterr().err
    assert re.fullmatch(r"report: .*/head_to_head\.csv does not exist; run: snakemake .*\n", error)


def test_the_same_results_give_the_same_bytes_and_no_network(article, made, tmp_path):
    path = tmp_path / "other.html"
    arguments = [*made.arguments("--article"), "--output", str(path)]
    subprocess.run(
        [sys.executable, "-m", "report", *arguments],
        check=True,
        capture_output=True,
        env=os.environ | {"PYTHONHASHSEED": "7"},
    )
    assert path.read_text(encoding="utf-8") == article.html
    assert all(element.get("src").startswith("data:image/png;") for element in article.all("img"))
    assert not article.all("script", "link", "iframe")
    assert article.html.count("url(") == 0
    (policy,) = [
        element.get("content") for element in article.all("meta") if element.get("http-equiv")
    ]
    assert policy.startswith("default-src 'none'")


def test_what_is_referred_to_is_there_and_what_is_there_is_referred_to(article):
    links = [element.get("href") for element in article.all("a")]
    targets = {link[1:] for link in links if link.startswith("#")}
    shown = {element.get("id") for element in article.elements if element.get("id")}
    assert targets <= shown
    assert {name for name in shown if name.startswith(("ref-", "table-", "figure-"))} <= targets
    assert all(element.get("alt") for element in article.all("img"))


def test_captions_in_words_are_grouped_by_what_they_state():
    """Numbers of the paper and other sources are not among them."""

    def row(metric, statement, mean, verdict, source="Figure 5 b", paper=None):
        own = {"metric": metric, "statement": statement, "source": source}
        own |= {"paper": paper, "criterion": None} if paper else {}
        claim = replace(load_claims().claims["outliers-ate-discerns"], **own)
        return Estimate(claim, mean, 0.1, 0.9, verdict, 0.1, 0.9, "open")

    rows = [
        row("TAS", "The TAS falls, as the TAS does", 0.5, "reproduced"),
        row("TAS", "The TAS rises", 0.25, "inconclusive", "Figure 7"),
        row("RAS", "The RAS falls, as the RAS does", 0.125, "not reproduced"),
        row("RAS", "The RAS rises", 0.25, "reproduced", "Figure 8"),
        row("TAS", "The TAS is 0.3", 0.25, "reproduced", paper=0.3),
        row("PAS", "The PAS falls, as the PAS does", 0.75, "reproduced"),
    ]
    assert report.article._captions(rows) == [
        {
            "rows": [rows[0], rows[2], rows[5]],
            "text": "It falls, as it does",
            "value": "0.125 to 0.750\u202fτ",
            "verdict": "2 of 3",
        },
        {
            "rows": [rows[1]],
            "text": "It rises",
            "value": "0.250\u202fτ",
            "verdict": "inconclusive",
        },
    ]


def test_verdicts_are_counted_by_their_source():
    """Sources in the order in which they are first named."""

    def row(source, verdict, population):
        claim = SimpleNamespace(source=source)
        return SimpleNamespace(claim=claim, verdict=verdict, population=population)

    rows = [
        row("Figure 5", "reproduced", "true"),
        row("Figure 2", "inconclusive", "open"),
        row("Figure 5", "not reproduced", "open"),
        row("Figure 5", "reproduced", "false"),
    ]
    assert report.article._tallies(rows) == [
        {
            "source": "Figure 5",
            "counted": 3,
            "counts": {"reproduced": 2, "inconclusive": 0, "not reproduced": 1},
            "populations": {"true": 1, "open": 1, "false": 1},
        },
        {
            "source": "Figure 2",
            "counted": 1,
            "counts": {"reproduced": 0, "inconclusive": 1, "not reproduced": 0},
            "populations": {"true": 0, "open": 1, "false": 0},
        },
    ]
