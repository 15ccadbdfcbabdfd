"""The page shows all that is in the folder, stands alone, and can be read by everybody."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pandas as pd
import pytest

from report.__main__ import main
from studies.claims.claims import load_claims
from tests.figures.conftest import FIGURES

from .conftest import Page

MakePage = Callable[..., Page]

CLAIMS = load_claims().claims


def test_every_claim_has_a_row_with_its_verdict_and_numbers(page: Page) -> None:
    rows = {row.get("id"): row for row in page.all("tr") if row.get("id")}
    assert list(rows) == [f"claim-{name}" for name in CLAIMS]
    for name, row in zip(CLAIMS, rows.values(), strict=True):
        verdict, expected, ours, mean = [cell.text for cell in row.all("td")]
        assert verdict[0] in "✓✗?"  # not by colour alone
        assert expected.endswith(CLAIMS[name].unit)
        assert ours.startswith("0.5")
        assert mean.split()[0] in ("true", "false", "open")
    text = page.id("claims").text
    assert all(claim.sentence in text for claim in CLAIMS.values())


def test_statements_are_counted_first_and_those_that_fail_stand_at_the_top(page: Page) -> None:
    (answer,) = [p for p in page.all("p") if p.get("class") == "answer"]
    assert answer.text.startswith("67 statements of the paper: ")
    assert "They make 104 claims: 61 reproduced, " in answer.text
    (header,) = page.all("header")
    exceptions = [item.text for item in header.all("li")]
    assert exceptions
    assert all(item.startswith(("✗ not reproduced", "? inconclusive")) for item in exceptions)
    assert "A quick look: the paper has 50 trials" in header.text


def test_it_needs_no_other_file_and_every_link_leads_somewhere(page: Page) -> None:
    assert page.html.endswith("</html>\n")
    assert not page.all("link", "iframe", "object", "base", "form", "script")
    assert page.html.count("url(") + page.html.count("@import") == 0
    ids = [element.get("id") for element in page.root.inner if element.get("id")]
    assert len(ids) == len(set(ids))
    assert all(image.get("src").startswith("data:image/png;base64,") for image in page.all("img"))
    for link in page.all("a"):
        href = link.get("href")
        assert href.startswith("https://") or href.removeprefix("#") in ids, href


def test_it_can_be_read_without_seeing_it(page: Page) -> None:
    levels = [int(heading.tag[1]) for heading in page.all("h1", "h2", "h3")]
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    assert all(len(image.get("alt")) > 80 for image in page.all("img"))
    assert all(len(table.all("caption")) == 1 for table in page.all("table"))
    assert all(th.get("scope") in ("row", "col") for th in page.all("th"))
    assert page.all("html")[0].get("lang") == "en"


def test_figures_table_1_and_readings_are_shown(page: Page) -> None:
    for name in FIGURES:
        assert len(page.id(f"figure-{name}").all("img")) == 1
    section = page.id("comparison")
    cells = [cell for cell in section.all("td") if "disagrees" in cell.get("class")]
    assert len(cells) == 6  # where the paper says no
    assert all("paper: no" in cell.text for cell in cells)
    assert "mean curve, 3 replicates: 2 of 2 verdicts change" in page.id("readings").text


def test_a_study_has_a_section_where_its_table_is_in_the_folder(page: Page) -> None:
    section = page.id("head_to_head")
    rows = [[cell.text for cell in row.all("th", "td")] for row in section.all("tr")]
    assert rows[1:] == [["outliers", "mAA", "90.25"], ["outliers", "TAS", "∞"]]
    assert not [each for each in page.all("section") if each.get("id") == "beyond"]


def test_the_command_names_settings_but_no_folders(page: Page) -> None:
    text = page.id("provenance").text
    assert "snakemake report --config trials=7 scenarios=mine.yaml" in text
    assert "/home/me" not in page.html


def test_costs_are_those_of_the_benchmarks(results: Path, make_page: MakePage) -> None:
    folder = results / "benchmarks/trials"
    folder.mkdir(parents=True)
    for name, seconds in (("a", 1.5), ("b", 2.0)):
        (folder / f"{name}.tsv").write_text(f"s\tcpu_time\tmax_rss\n9\t{seconds}\t100\n")
    table = make_page(results).id("provenance").all("table")[-1]
    assert [cell.text for cell in table.all("th", "td")][-4:] == ["trials", "2", "4", "100"]


def test_the_same_results_give_the_same_page(results: Path, make_page: MakePage) -> None:
    assert make_page(results).html == make_page(results).html


def test_an_undefined_statistic_has_no_number(results: Path, make_page: MakePage) -> None:
    table = pd.read_csv(results / "claims.csv")
    table.loc[0, ["ours", "low", "high"]] = None
    table.to_csv(results / "claims.csv", index=False)
    page = make_page(results)
    assert "– τ [–, –]" in page.id(f"claim-{table['id'][0]}").text
    assert "nan" not in page.id("claims").text


@pytest.mark.parametrize(
    "name", ["claims.csv", "tables/readings.csv", "figures/outliers.png", "trials/rotations.json"]
)
def test_a_missing_file_is_named_in_one_line(
    results: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (results / name).unlink()
    html = results / "report.html"
    assert main([str(results), "--output", str(html)]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{name} does not exist" in line
    assert not html.exists()
