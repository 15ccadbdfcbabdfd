"""The claims are complete, well formed, and refused in one line where they are not."""

import json
from copy import deepcopy
from dataclasses import replace

import pytest
import yaml

from experiments.config import ConfigError
from studies.statements import CLAIMS_FILE, Reading, load_claims
from tests.study.figures.conftest import FIGURES

from .conftest import CLAIMS

# The percentages in the captions of figures 2, 6 and 7.
PAPER = [-74, -51, -66, 13, -84, 14, -75, -50, -94, -55, -74, -59, -73, -24]


def test_the_numbers_that_the_documentation_names():
    """docs/explanation/findings.md: 67 statements, 104 claims, and 26 that follow from them."""
    implied = [claim for claim in CLAIMS.claims.values() if claim.implied_by]
    counted = [claim for claim in CLAIMS.claims.values() if not claim.implied_by]
    assert len({(claim.source, claim.sentence) for claim in counted}) == 67
    assert (len(counted), len(implied)) == (104, 26)
    assert [c.paper for c in CLAIMS.claims.values() if c.paper is not None] == PAPER


def test_every_claim_has_a_figure_that_shows_its_experiment_and_its_number():
    for claim in CLAIMS.claims.values():
        assert claim.experiment in FIGURES[claim.figure][1]
        if claim.paper is not None:
            word = "smaller" if claim.paper < 0 else "greater"
            assert f"{abs(claim.paper):g} % {word}" in claim.statement


def test_a_reading_changes_what_it_names_alone():
    claims = CLAIMS.claims
    pooled = Reading("pooled", metrics={"mAA": "mAA(pooled=true)"})
    assert pooled.of(claims["outliers-range-maa"]).metric == "mAA(pooled=true)"
    assert pooled.of(claims["outliers-tas-consistent"]).versus == "mAA(pooled=true)"
    assert pooled.of(claims["outliers-range-tas"]) == claims["outliers-range-tas"]
    changed = replace(claims["outliers-range-maa"], metric="mAA(pooled=false)")
    assert pooled.of(changed) == changed
    on_lines = Reading("ray", experiments=["collinear"], settings=["geometry=ray"])
    assert on_lines.of(claims["collinear-maa-weak"]).settings == ["geometry=ray"]
    assert on_lines.of(claims["line-maa-discerns"]) == claims["line-maa-discerns"]
    everywhere = Reading("all noise", everywhere=True)
    assert everywhere.of(claims["length-tas-much-below-dte"]).at == {}
    reading = Reading("0, 1, 50", where={"n_outliers": [0, 1, 50]})
    beats = claims["outliers-tas-beats-dte"]
    assert reading.of(beats).where == {**beats.where, "n_outliers": [1, 50]}
    ordered = Reading("order", statistics={"size of range change": "size of order change"})
    assert ordered.of(claims["outliers-tas-consistent"]).statistic == "size of order change"
    means = Reading("means", of_means=True)
    assert means.of(claims["outliers-range-maa"]).of_means
    assert not means.of(claims["outliers-tas-discerns"]).of_means


def test_replicates_can_be_set_but_one_is_none():
    assert load_claims(3).replicates == 3
    for wrong in (1, "many", 2.5):
        with pytest.raises(ConfigError, match="'replicates' must be a whole number"):
            load_claims(wrong)  # type: ignore[arg-type]


CONTENT = yaml.load(CLAIMS_FILE.read_text(), yaml.CSafeLoader)
CLAIM = ["groups", 0, "claims", 0]
DECISION = ["decisions", 0]


@pytest.mark.parametrize(
    ("keys", "value", "problem"),
    [
        (["groups"], ..., "groups is missing"),
        (["groups", 0], "Figure 2", "groups.0 needs key: value"),
        ([*CLAIM, "id"], ..., "a claim of Figure 2: id: is missing"),
        ([*CLAIM, "id"], "outliers-ate-blind", "'outliers-ate-blind' is defined twice"),
        ([*CLAIM, "statement"], ..., "'outliers-ate-discerns': statement: is missing"),
        ([*CLAIM, "statistic"], "range change", "'outliers-ate-discerns': needs 'before' for its"),
        ([*CLAIM, "level"], "sigma", "'outliers-ate-discerns': level.0: must be one of n_cameras,"),
        ([*CLAIM, "metric"], "APE", "'outliers-ate-discerns': metric: unknown metric 'APE'"),
        (
            [*CLAIM, "paper"],
            -74,
            "'outliers-ate-discerns': needs either a number of the paper",
        ),
        ([*CLAIM, "criterion"], "below five", "'outliers-ate-discerns': needs a criterion such as"),
        ([*CLAIM, "remark"], "-", "'outliers-ate-discerns': remark: is unknown"),
        ([*CLAIM, "implied_by"], ["no"], "'outliers-ate-discerns' is implied by no claim: 'no'"),
        ([*DECISION, "readings"], [], "'volume': readings: needs 2 or more entries, not []"),
        ([*DECISION, "claims"], ["no-such"], "'volume' names no claim: 'no-such'"),
        (
            [*DECISION, "readings", 0, "metrics"],
            {"mAA": "mAA(steps=1)"},
            "'volume': readings.0.metrics.mAA: metric 'mAA(steps=1)' has",
        ),
    ],
    ids=str,
)
def test_a_broken_file_is_refused_in_one_line(tmp_path, keys, value, problem):
    content = deepcopy(CONTENT)
    *parents, last = keys
    parent = content
    for key in parents:
        parent = parent[key]
    if value is ...:
        del parent[last]
    else:
        parent[last] = value
    path = tmp_path / "claims.yaml"
    path.write_text(json.dumps(content))  # JSON is YAML, and sooner written
    with pytest.raises(ConfigError) as caught:
        load_claims(path=path)
    _, _, message = str(caught.value).partition("claims.yaml: ")
    assert message.startswith(problem)
    assert "\n" not in message
