"""The page shows all that is in the folder, stands alone, and can be read by everybody."""

from itertools import pairwise

import pandas as pd
import pytest

from report.__main__ import main
from studies.claims.claims import load_claims
from tests.figures.conftest import FIGURES

from .conftest import text_of

CLAIMS = load_claims().claims


def test_every_claim_has_a_row_with_its_verdict_and_numbers(page):
    rows = {row["id"]: row for row in page.find_all("tr", id=True)}
    assert list(rows) == [f"claim-{name}" for name in CLAIMS]
    for name, row in zip(CLAIMS, rows.values(), strict=True):
        verdict, expected, ours, mean = map(text_of, row.find_all("td"))
        assert verdict[0] in "✓✗?"  # not by colour alone
        assert expected.endswith(CLAIMS[name].unit)
        assert ours.startswith("0.5")
        assert mean.split()[0] in ("true", "false", "open")
    text = text_of(page.find(id="claims"))
    assert all(claim.sentence in text for claim in CLAIMS.values())


def test_statements_are_counted_first_and_those_that_fail_stand_at_the_top(page):
    (answer,) = map(text_of, page.find_all("p", class_="answer"))
    assert answer.startswith("67 statements of the paper: ")
    assert "They make 104 claims: 61 reproduced, " in answer
    (header,) = page.find_all("header")
    exceptions = [text_of(item) for item in header.find_all("li")]
    assert exceptions
    assert all(item.startswith(("✗ not reproduced", "? inconclusive")) for item in exceptions)
    assert "A quick look: the paper has 50 trials" in text_of(header)


def test_it_needs_no_other_file_and_every_link_leads_somewhere(page):
    html = str(page)
    assert html.endswith("</html>\n")
    assert not page.find_all(["link", "iframe", "object", "base", "form", "script"])
    assert html.count("url(") + html.count("@import") == 0
    ids = [element["id"] for element in page.find_all(id=True)]
    assert len(ids) == len(set(ids))
    assert all(each["src"].startswith("data:image/png;base64,") for each in page.find_all("img"))
    for link in page.find_all("a"):
        href = link["href"]
        assert href.startswith("https://") or href.removeprefix("#") in ids, href


def test_it_can_be_read_without_seeing_it(page):
    levels = [int(heading.name[1]) for heading in page.find_all(["h1", "h2", "h3"])]
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    assert all(len(image["alt"]) > 80 for image in page.find_all("img"))
    assert all(len(table.find_all("caption")) == 1 for table in page.find_all("table"))
    assert all(th["scope"] in ("row", "col") for th in page.find_all("th"))
    assert page.html["lang"] == "en"


def test_figures_table_1_and_readings_are_shown(page):
    for name in FIGURES:
        assert len(page.find(id=f"figure-{name}").find_all("img")) == 1
    cells = page.find(id="comparison").find_all("td", class_="disagrees")
    assert len(cells) == 6  # where the paper says no
    assert all("paper: no" in text_of(cell) for cell in cells)
    assert "mean curve, 3 replicates: 2 of 2 verdicts change" in text_of(page.find(id="readings"))


def test_a_study_has_a_section_where_its_table_is_in_the_folder(page):
    rows = page.find(id="head_to_head").find_all("tr")
    rows = [[text_of(cell) for cell in row.find_all(["th", "td"])] for row in rows]
    assert rows[1:] == [["outliers", "mAA", "90.25"], ["outliers", "TAS", "∞"]]
    assert page.find(id="beyond") is None


def test_the_command_names_settings_but_no_folders(page):
    text = text_of(page.find(id="provenance"))
    assert "snakemake report --config trials=7 scenarios=mine.yaml" in text
    assert "/home/me" not in str(page)


def test_costs_are_those_of_the_benchmarks(results, make_page):
    folder = results / "benchmarks/trials"
    folder.mkdir(parents=True)
    for name, seconds in (("a", 1.5), ("b", 2.0)):
        (folder / f"{name}.tsv").write_text(f"s\tcpu_time\tmax_rss\n9\t{seconds}\t100\n")
    table = make_page(results).find(id="provenance").find_all("table")[-1]
    assert [text_of(cell) for cell in table.find_all(["th", "td"])][-4:] == [
        "trials",
        "2",
        "4",
        "100",
    ]


@pytest.mark.parametrize(
    "name", ["claims.csv", "tables/readings.csv", "figures/outliers.png", "trials/rotations.json"]
)
def test_a_missing_file_is_named_in_one_line(results, name, capsys):
    (results / name).unlink()
    html = results / "report.html"
    assert main([str(results), "--output", str(html)]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{name} does not exist" in line
    assert not html.exists()


def test_an_undefined_statistic_has_no_number(results, make_page):
    table = pd.read_csv(results / "claims.csv")
    table.loc[0, ["ours", "low", "high"]] = None
    table.to_csv(results / "claims.csv", index=False)
    page = make_page(results)
    assert "– τ [–, –]" in text_of(page.find(id=f"claim-{table['id'][0]}"))
    assert "nan" not in text_of(page.find(id="claims"))
