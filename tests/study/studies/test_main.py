"""The program of the studies: what each writes, and the line in which it ends without."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from experiments.config import experiment_names, load_sweep
from experiments.metrics import metric as find
from experiments.tables import Record, read_trials
from studies.__main__ import main
from studies.beyond import findings
from studies.claims import decide, plan
from studies.table1 import compare, to_markdown

from .conftest import CLAIMS, undescribed


def worsens(metric, cell, trial, rng):
    """Get worse with all noise and outliers."""
    sign = -find(metric).sign
    level = 10 * cell.sigma_t + cell.sigma_r_deg + cell.n_outliers / 10
    return sign * (level + 1e-3 * rng.random())


@pytest.fixture
def line(capsys):
    """Return the one line of what went wrong."""

    def of_stderr():
        (only,) = capsys.readouterr().err.splitlines()
        return only.removeprefix("studies: ")

    return of_stderr


def test_table1_is_written_as_csv_and_markdown(make_up, written, tmp_path, line, capsys):
    small = {"combined": ["sigma_t=[0.05]", "sigma_r_deg=[3]"]}
    sweeps = {
        name: load_sweep([f"experiment={name}", "trials=2", *small.get(name, [])])
        for name in experiment_names()
    }
    paths = written({name: make_up(sweep, value=worsens) for name, sweep in sweeps.items()})
    table, text = tmp_path / "a" / "table1.csv", tmp_path / "b" / "table1.md"
    assert main(["table1", *paths, "--output", str(table), str(text)]) == 0
    assert capsys.readouterr().out == f"{table}\n{text}\n"
    expected = compare(
        {name: read_trials(Path(path)) for name, path in zip(sweeps, paths, strict=True)}
    )
    assert text.read_text() == to_markdown(expected)
    pd.testing.assert_frame_equal(pd.read_csv(table), expected)
    assert undescribed(compare, expected) == []

    table.unlink()
    assert main(["table1", *paths, "--output", str(table)]) == 1
    assert line() == "table1 writes 2 files, not 1"
    assert main(["table1", *paths[1:], "--output", str(table), str(text)]) == 1
    lacking = "these tables, which lack 'collinear', are not from table1"
    assert line() == f"{lacking}; see the rules of the Snakefile"
    Path(paths[0]).unlink()
    assert main(["table1", *paths, "--output", str(table), str(text)]) == 1
    assert line() == f"{paths[0]} does not exist; run: snakemake {paths[0]}"
    assert not table.exists()


@pytest.mark.slow
def test_claims_have_verdicts_and_decisions(make_up, written, tmp_path, line):
    outputs = [tmp_path / name for name in ("claims.csv", "readings.csv", "criteria.csv", "a.html")]
    sweeps = [replace(sweep, trials=2) for sweep in plan(CLAIMS.needed(0))]
    paths = written(
        {
            str(k): make_up(*(replace(each, replicate=k) for each in sweeps), value=worsens, seed=k)
            for k in range(2)
        }
    )
    assert main(["claims", *paths, "--output", *map(str, outputs)]) == 0
    table = pd.read_csv(outputs[0]).set_index("id")
    assert list(table.index) == list(CLAIMS.claims)
    assert undescribed(decide, table) == []
    for name in ("outliers-tas-discerns", "rotations-ras-noise", "combined-pas-both"):
        assert table["verdict"][name] == "reproduced"
    assert table["verdict"]["outliers-ate-blind"] == "not reproduced"
    readings = pd.read_csv(outputs[1])
    assert undescribed(decide, readings) == []
    assert set(readings["decision"]) == {decision.id for decision in CLAIMS.decisions}
    page = outputs[3].read_text()
    assert page.count('<tr id="') == len(table)
    criteria = pd.read_csv(outputs[2])
    assert undescribed(decide, criteria) == []
    assert len(criteria) == sum(len(criterion.others) for criterion in CLAIMS.criteria)

    outputs[0].unlink()
    assert main(["claims", paths[0], "--output", *map(str, outputs)]) == 1
    assert "at least two replicate studies" in line()
    assert main(["claims", paths[0], paths[0], "--output", *map(str, outputs)]) == 1
    assert line() == f"{paths[0]} is not replicate 1: name them in order, once"
    assert not outputs[0].exists()


def test_scenarios_have_findings(make_up, written, tmp_path, line):
    settings = ["experiment=maa_vs_pas_outliers", "metrics=[TAS,ATE]", "trials=4"]
    sweep = load_sweep(["n_outliers=[0,10]", *settings])
    trials = make_up(replace(sweep, name="beyond_own/a"), value=worsens)
    paths = written({"a": trials, "b": trials})
    output = tmp_path / "own.csv"
    assert main(["beyond", *paths, "--output", str(output)]) == 0
    table = pd.read_csv(output)
    assert undescribed(findings, table) == []
    assert table[["scenario", "metric"]].to_numpy().tolist() == [
        [name, metric] for name in "ab" for metric in ("TAS", "ATE")
    ]

    record = Record((replace(sweep, metrics=["TAS", "PAS"]),), {})
    paths = written({"a": replace(trials, record=record)})
    output.unlink()
    assert main(["beyond", *paths, "--output", str(output)]) == 1
    assert f"{paths[0]} has no column PAS; delete it and run: snakemake {paths[0]}" == line()
    assert not output.exists()
