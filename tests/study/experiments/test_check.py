"""Results are compared with the published ones, and what differs is named."""

from pathlib import Path

import pandas as pd
import pytest

from experiments.check import main
from experiments.config import load_sweep
from experiments.sweep import run_sweeps
from experiments.tables import write_trials


def write(folder, *settings):
    """Run an experiment, write its trials, and return their path."""
    sweep = load_sweep(settings)
    path = folder / "trials" / f"{sweep.name}.csv"
    write_trials(path, run_sweeps([sweep]), [sweep])
    return path


@pytest.mark.slow
def test_an_experiment_is_as_published(tmp_path, capsys):
    path = write(tmp_path, "experiment=maa_vs_pas_length")
    assert main([str(tmp_path)]) == 0
    assert f"{path} is as published" in capsys.readouterr().out.splitlines()


def test_what_was_published_is_compared_by_the_means_of_cells(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("experiments.check.PUBLISHED", tmp_path / "published")
    results = tmp_path / "results"
    path = write(results, "experiment=outliers", "trials=2", "n_outliers=[0]", "sigma_t=[0.05]")
    assert main([str(results), "--publish"]) == 0
    assert main([str(results)]) == 0
    printed = capsys.readouterr().out
    assert printed.endswith(f"{path} is as published\n1 of 1 compared tables agree\n")
    text = path.read_text()
    path.write_text(text[:-2] + str((int(text[-2]) + 1) % 10) + "\n")
    assert main([str(results)]) == 1
    assert f"{path} was changed, or outliers.json is not" in capsys.readouterr().err


def test_a_changed_digit_of_a_table_is_noticed(tmp_path, capsys):
    published = Path(__file__).parents[3] / "experiments" / "published"
    path = tmp_path / "tables" / "method_comparison.csv"
    path.parent.mkdir()
    table = pd.read_csv(published / "tables" / path.name)
    table.to_csv(path, index=False)
    assert main([str(tmp_path)]) == 0
    printed = capsys.readouterr().out.splitlines()[-1]
    assert printed.startswith("1 of 1 compared tables agree; not made yet: claims.csv, ")
    assert "tables/minus59.csv (by snakemake readings)" in printed
    assert "trials/outliers.csv" in printed
    row = table["value"].first_valid_index()
    table.loc[row + 1, "value"] *= 1.0001
    table.to_csv(path, index=False)
    assert main([str(tmp_path)]) == 1
    assert f"{path} (row {row + 2}, value is " in capsys.readouterr().err
    assert main([str(tmp_path / "tables")]) == 1
    assert "has no published table; run: snakemake figures" in capsys.readouterr().err


def test_each_claim_that_differs_is_named_with_what_differs(tmp_path, capsys, monkeypatch):
    claims = pd.DataFrame({"id": list("abcdef"), "ours": 0.5, "verdict": "reproduced"})
    monkeypatch.setattr("experiments.check.PUBLISHED", tmp_path / "published")
    for folder in ("published", "results"):
        (tmp_path / folder).mkdir()
        claims.to_csv(tmp_path / folder / "claims.csv", index=False)
    assert main([str(tmp_path / "results")]) == 0
    claims.loc[1:5, "ours"] = 0.4
    claims.loc[2, "verdict"] = "inconclusive"
    claims.to_csv(tmp_path / "results" / "claims.csv", index=False)
    capsys.readouterr()
    assert main([str(tmp_path / "results")]) == 1
    printed = capsys.readouterr().err
    assert printed.count("ours is 0.4, published 0.5") == 5
    assert "c, ours is 0.4, published 0.5, verdict is inconclusive, published reproduced" in printed


def test_other_settings_are_named_before_numbers(tmp_path, capsys):
    path = write(tmp_path, "experiment=outliers", "trials=2", "n_outliers=[0]", "tas.order=0.2")
    assert main([str(tmp_path)]) == 1
    assert capsys.readouterr().err == (
        f"experiments.check: not as published: {path} (other settings: tas.order 0.2, published "
        "0.1; n_outliers 0, published 0, 1, 10, 20, 30, 40, 50; trials 2, published 50)\n"
    )
