import re
from pathlib import Path

import pandas as pd
import pytest
import yaml

from figures.captions import captions, main, to_markdown

CLAIMS = Path(__file__).parents[3] / "configs" / "claims.yaml"
EXPERIMENTS = ("outliers", "combined", "maa_vs_pas_outliers", "maa_vs_pas_collinear")


@pytest.fixture(scope="module")
def trials(run):
    return pd.concat([run(name).table for name in EXPERIMENTS], ignore_index=True)


def test_the_percentages_are_those_of_the_ranges(trials):
    table = captions(trials)
    assert len(table) == 14
    combined = trials[trials["experiment"] == "combined"]
    row = table[table["figure"].eq("6") & table["metric"].eq("PAS")].iloc[0]
    assert row["comparison"] == "σr of 9° against 1°"
    assert row["paper"] == 13
    before, after = (combined.loc[combined["sigma_r_deg"] == level, "PAS"] for level in (1, 9))
    widths = [max(values) - min(values) for values in (before, after)]
    assert row["all_trials"] == pytest.approx(100 * (widths[1] / widths[0] - 1))
    means = [
        [
            combined.loc[
                combined["sigma_r_deg"].eq(level) & combined["sigma_t"].eq(noise), "PAS"
            ].mean()
            for noise in noises
        ]
        for level, noises in dict.fromkeys((1, 9), combined["sigma_t"].unique()).items()
    ]
    widths = [max(values) - min(values) for values in means]
    assert row["means"] == pytest.approx(100 * (widths[1] / widths[0] - 1))


def test_the_captions_are_those_of_the_claims(trials):
    """Each percentage of the paper stands in the claims, with the same metric and experiment."""
    groups = yaml.safe_load(CLAIMS.read_text(encoding="utf-8"))["groups"]
    claimed = [
        (re.sub(r"\W|Figure", "", group["source"]), claim["metric"], claim["paper"])
        for group in groups
        for claim in group["claims"]
        if claim["statistic"] == "range change"
    ]
    table = captions(trials)[["figure", "metric", "paper"]]
    assert list(table.itertuples(index=False, name=None)) == claimed


def test_a_side_that_the_trials_lack_is_no_number(trials):
    table = captions(trials[trials["n_outliers"] != 50])
    lacking = table["comparison"].eq("50 outliers against none")
    assert table["all_trials"].isna().equals(lacking)
    assert table["means"].isna().equals(lacking)
    assert to_markdown(table).count("–") == 2 * lacking.sum()


def test_it_writes_both_files_and_refuses_other_tables_in_one_line(run, tmp_path, capsys):
    paths = [tmp_path / f"{name}.csv" for name in EXPERIMENTS]
    for path, name in zip(paths, EXPERIMENTS, strict=True):
        run(name).table.to_csv(path, index=False)
    written = [tmp_path / "tables" / f"captions.{end}" for end in ("csv", "md")]
    assert main([*map(str, paths), "--output", *map(str, written)]) == 0
    assert len(pd.read_csv(written[0])) == 14
    assert written[1].read_text(encoding="utf-8").count("\n| ") == 14
    capsys.readouterr()
    for wrong, problem in (
        (paths[:3], "there is no trial of the experiment maa_vs_pas_collinear"),
        (paths[:1], "there is no column PAS"),
        ([tmp_path / "no.csv"], f"cannot read {tmp_path / 'no.csv'}: No such file or directory"),
    ):
        assert main([*map(str, wrong), "--output", str(tmp_path / "wrong.csv")]) == 1
        assert capsys.readouterr().err == f"figures.captions: {problem}\n"
    assert not (tmp_path / "wrong.csv").exists()
