"""A comparison against a saved one, by the command."""

import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from alignscores import Settings
from alignscores.comparison.baseline import NEEDED, Changes, changes, read_baseline
from alignscores.comparison.benchmark import Run
from alignscores.comparison.runs import Outcome
from alignscores.comparison.summary import summarise
from alignscores.trajectories.formats import FORMATS

SYSTEMS = {"orb": (0.1, 1.0, 1, 0.0), "dso": (0.1, 1.0, 1, 0.0)}
WORSE = {"orb": (0.3, 3.0, 1, 0.0), "dso": (0.1, 1.0, 1, 0.0)}


@pytest.fixture
def gate(run_compare, benchmark_of, tmp_path):
    """(what is done to the files in between, options) -> exit code, output, errors."""

    def gate(change, *options, first=(), systems=SYSTEMS):
        patterns = benchmark_of(systems, n=60)
        common = *patterns, "--jobs", 1
        (tmp_path / "saved.json").write_text(run_compare(*common, "--json", *first)[1])
        change()
        return run_compare(*common, "--baseline", "saved.json", "--fail_on", "worse", *options)

    return gate


def rows_of(out):
    _, _, table = out.partition("PAS against saved.json\n")
    return [line.split() for line in table.splitlines()]


def test_nothing_changed(gate):
    code, out, err = gate(lambda: None)
    assert (code, err) == (0, "")
    header, *rows = rows_of(out)
    assert header == ["system", "saved", "now", "difference", "95", "%", "interval", "change"]
    assert {row[0] for row in rows} == {"orb", "dso"}
    for row in rows:
        assert row[1] == row[2]
        assert row[3] == "+0"
        assert row[-4:] == ["none", "that", "is", "certain"]


def test_a_system_that_is_certainly_worse(gate, benchmark_of):
    code, out, _ = gate(lambda: benchmark_of(WORSE, n=60))
    assert code == 3
    assert "\n\nPAS against" in out
    changes = {row[0]: row[-1] for row in rows_of(out)[1:]}
    assert changes == {"orb": "worse", "dso": "certain"}


def test_the_difference_is_that_of_now_and_then(gate, benchmark_of):
    code, out, _ = gate(lambda: benchmark_of(WORSE, n=60), "--json")
    assert code == 3
    (orb,) = (e for e in json.loads(out)["baseline"]["systems"] if e["system"] == "orb")
    assert orb["low"] < orb["difference"] < orb["high"] < 0
    assert orb["difference"] == pytest.approx(orb["now"] - orb["saved"])


def test_a_system_that_is_better_is_no_failure(gate, benchmark_of):
    code, out, _ = gate(lambda: benchmark_of(SYSTEMS, n=60), "--json", systems=WORSE)
    assert code == 0
    found = json.loads(out)["baseline"]
    (orb,) = (entry for entry in found["systems"] if entry["system"] == "orb")
    assert orb["change"] == "better"
    assert 0 < orb["low"] < orb["difference"] < orb["high"]
    assert orb["difference"] == pytest.approx(orb["now"] - orb["saved"])
    assert (found["worse"], found["notes"]) == (False, [])


def test_of_errors_the_larger_is_worse(gate, benchmark_of):
    by = "--metrics", "ate:rmse", "--by", "ate:rmse"
    code, out, _ = gate(lambda: benchmark_of(WORSE, n=60), *by, "--json", first=by)
    assert code == 3
    (orb,) = (e for e in json.loads(out)["baseline"]["systems"] if e["system"] == "orb")
    assert 0 < orb["low"] < orb["difference"] < orb["high"]
    assert orb["difference"] == pytest.approx(orb["now"] - orb["saved"])


def test_runs_that_all_fail_are_worse(gate, tmp_path):
    def fail():
        for file in tmp_path.glob("*/orb/*.txt"):
            file.write_text("nothing")

    code, out, _ = gate(fail)
    assert code == 3
    (orb,) = (row for row in rows_of(out) if row[0] == "orb")
    assert orb[2] == "0"


def test_a_sequence_on_which_no_run_is_scored_is_not_one_of_another_reference(gate, tmp_path):
    def fail():
        for file in tmp_path.glob("car/*/*.txt"):
            file.write_text("nothing")

    unit = "--unit", 0.8
    assert "left out" not in gate(fail, *unit, first=unit)[1]


def test_a_saved_run_that_failed_has_no_score(gate, tmp_path):
    def change():
        saved = json.loads((tmp_path / "saved.json").read_text())
        saved["results"][0] |= {"PAS": 0, "status": "failed", "error": "lost"}
        (tmp_path / "saved.json").write_text(json.dumps(saved))

    systems = json.loads(gate(change, "--json")[1])["baseline"]["systems"]
    (failed,) = (entry for entry in systems if entry["now"] != entry["saved"])
    assert failed["now"] - failed["saved"] > 0.1
    assert abs(failed["difference"]) < 0.01


def test_what_is_new_or_gone_is_named(gate, tmp_path):
    def change():
        shutil.move(tmp_path / "car/dso", tmp_path / "car/lsd")
        shutil.rmtree(tmp_path / "helix")
        shutil.copy(tmp_path / "car/orb/0.txt", tmp_path / "car/orb/9.txt")

    code, out, _ = gate(change)
    assert code == 0
    assert out.splitlines()[-4:] == [
        *("new systems: lsd", "new runs: orb on car, 9", "gone sequences: helix"),
        "gone systems: dso",
    ]


def test_a_sequence_with_another_reference_is_left_out(gate, tmp_path):
    def change():
        poses = np.loadtxt(tmp_path / "car/gt.txt")
        poses[:, 1:4] *= 2
        np.savetxt(tmp_path / "car/gt.txt", poses)

    code, out, _ = gate(change)
    assert code == 0
    assert out.splitlines()[-1].startswith("left out: sequence car, whose d was ")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("nonsense", "is not what `alignscores compare --json` prints"),
        ("[1, 2]", "is not what `alignscores compare --json` prints"),
        ('{"results": []}', "is not what `alignscores compare --json` prints"),
        ('{"results": [{"system": "orb"}]}', "is not what `alignscores compare --json` prints"),
        (None, "cannot be read (No such file or directory)"),
    ],
)
def test_a_broken_file(run_compare, examples, tmp_path, content, reason):
    file = tmp_path / "saved.json"
    if content:
        file.write_text(content)
    patterns = examples / "tum/reference.txt", examples / "tum/{system}.txt"
    code, out, err = run_compare("tum", *patterns, "--baseline", file)
    assert (code, out, err) == (1, "", f"alignscores: error: {file}: {reason}\n")


def test_a_file_of_which_a_run_lacks_a_score(gate, tmp_path):
    def change():
        saved = json.loads((tmp_path / "saved.json").read_text())
        del saved["results"][1]["PAS"]
        (tmp_path / "saved.json").write_text(json.dumps(saved))

    code, out, err = gate(change)
    assert (code, out) == (1, "")
    assert "saved.json: is not what `alignscores compare --json` prints" in err


def test_models_in_another_number_of_parts_do_not_compare(gate, tmp_path):
    def change():
        saved = json.loads((tmp_path / "saved.json").read_text())
        saved["results"] = [result | {"parts": 2} for result in saved["results"]]
        (tmp_path / "saved.json").write_text(json.dumps(saved))

    found = json.loads(gate(change, "--json")[1])["baseline"]["systems"]
    assert {(entry["difference"], entry["change"]) for entry in found} == {(None, None)}


def test_other_settings_do_not_compare(gate):
    code, out, err = gate(lambda: None, "--registration", "pcr99")
    assert (code, out) == (1, "")
    assert err == (
        'alignscores: error: saved.json: has registration "refined", not "pcr99": '
        "nothing compares\n"
    )


def test_the_gate_needs_a_baseline(run_compare, examples):
    files = examples / "tum/reference.txt", examples / "tum/{system}.txt"
    code, out, err = run_compare("tum", *files, "--fail_on", "worse")
    assert (code, out) == (2, "")
    assert "error: argument --fail_on: needs --baseline FILE; see" in err


def by_hand(metrics=(), **values):
    """(system and sequence: values of a metric) -> what was scored, in runs 1, 2 and so on."""
    names = "TAS", "RAS", "PAS", "half_distance", "half_angle", *metrics
    runs = [
        (
            Run(name[1:], name[0], str(number), "file"),
            Outcome(dict.fromkeys(names, value), n=10, unit=1.0),
        )
        for name, several in values.items()
        for number, value in enumerate(several, 1)
    ]
    summary = summarise(runs, metrics, FORMATS["tum"])
    return SimpleNamespace(summary=summary, settings=Settings(format="tum"))


def saved_of(**values):
    return json.loads(json.dumps(by_hand(**values).summary.results).replace("Infinity", "null"))


def test_what_changed_of_systems_by_hand():
    """One is worse, one better, one as it was; of each the runs scatter by nothing."""
    now = by_hand(xs=[0.5] * 8, ys=[0.75] * 8, zs=[0.25] * 8)
    saved = saved_of(xs=[0.75] * 8, ys=[0.5] * 8, zs=[0.25] * 8)
    found = changes(now, "saved.json", saved, "PAS")
    at = {"question": "new_runs"}
    assert sorted(found.systems, key=lambda entry: entry["system"]) == [
        {"system": "x", "now": 0.5, "saved": 0.75, "change": "worse", **at, **exactly(-0.25)},
        {"system": "y", "now": 0.75, "saved": 0.5, "change": "better", **at, **exactly(0.25)},
        {"system": "z", "now": 0.25, "saved": 0.25, "change": None, **at, **exactly(0)},
    ]
    assert found.worse
    assert found.to_dict() == {
        **{"file": "saved.json", "metric": "PAS", "worse": True},
        **{"notes": [], "systems": found.systems},
    }
    of_errors = changes(now, "saved.json", saved, "half_angle").systems
    named = {entry["system"]: (entry["change"], entry["difference"]) for entry in of_errors}
    assert named == {"x": ("better", -0.25), "y": ("worse", 0.25), "z": (None, 0)}


def exactly(value):
    return dict.fromkeys(("difference", "low", "high"), value)


def test_what_is_new_or_gone_by_hand():
    now = by_hand(xs=[0.5, 0.5], ys=[0.5], xt=[0.5], zu=[0.5])
    saved = saved_of(xs=[0.5], ws=[0.5], xv=[0.5], zu=[0.5, 0.5])
    assert changes(now, "f", saved, "PAS").notes == [
        "new sequences: t",
        "new systems: y",
        "new runs: x on s, 2",
        "gone sequences: v",
        "gone systems: w",
        "gone runs: z on u, 2",
    ]
    assert (
        changes(now, "f", saved_of(xs=[0.5, 0.5], ys=[0.5], xt=[0.5], zu=[0.5]), "PAS").notes == []
    )


@pytest.mark.parametrize(
    ("unit", "left_out"),
    [(1, None), (1 + 9e-7, None), (1 + 1.2e-6, "1"), (1.23456, "1.235"), (0.5, "0.5")],
)
def test_another_unit_does_not_compare(unit, left_out):
    now = by_hand(xs=[0.5, 0.5], xt=[0.75, 0.75])
    saved = saved_of(xs=[0.25, 0.25], xt=[0.75, 0.75])
    for result in saved[:2]:
        result["unit"] = unit
    saved[1]["unit"] = None
    found = changes(now, "f", saved, "PAS")
    notes = [f"left out: sequence s, whose d was {left_out} and is 1"] if left_out else []
    assert found.notes == notes
    (entry,) = found.systems
    assert entry["now"] - entry["saved"] == (0 if left_out else 0.125)


@pytest.mark.parametrize("name", ["PAS", "half_angle"])
def test_the_interval_is_that_of_two_systems(name):
    """The one now better, and the other way round."""
    first, second = [0.5, 0.75, 0.875], [0.25, 0.5]
    for now, saved in ((first, second), (second, first)):
        (entry,) = changes(by_hand(xs=now), "f", saved_of(xs=saved), name).systems
        expected = stats.ttest_ind(now, saved, equal_var=False).confidence_interval()
        limit = np.inf if name == "half_angle" else 1.0
        assert entry["difference"] == pytest.approx(np.mean(now) - np.mean(saved))
        assert (entry["low"], entry["high"]) == pytest.approx(
            (max(expected.low, -limit), min(expected.high, limit))
        )


def test_an_older_file_has_what_is_needed_and_no_more(tmp_path):
    saved = saved_of(xs=[0.5, 0.5])
    older = [{key: result[key] for key in NEEDED} for result in saved]
    (tmp_path / "saved.json").write_text(json.dumps({"results": older}))
    found = read_baseline(str(tmp_path / "saved.json"), Settings(format="tum"))
    assert found == older
    (entry,) = changes(by_hand(xs=[0.75, 0.75]), "f", found, "PAS").systems
    assert (entry["difference"], entry["change"]) == (0.25, None)


def test_a_metric_that_was_asked_for_is_compared():
    """Of the errors the smaller is better."""
    now, saved = (by_hand(xs=[value] * 8, metrics=["ate:rmse"]) for value in (0.5, 0.75))
    found = changes(now, "f", json.loads(json.dumps(saved.summary.results)), "ate:rmse")
    (entry,) = found.systems
    assert (entry["now"], entry["saved"], entry["change"]) == (0.5, 0.75, "better")


def test_an_infinite_error_is_saved_as_null():
    saved = saved_of(xs=[0.5, np.inf])
    assert saved[1]["half_distance"] is None
    (entry,) = changes(by_hand(xs=[0.5, 0.5]), "f", saved, "half_distance").systems
    assert (entry["now"], entry["saved"], entry["difference"]) == (0.5, None, None)


CHANGED = """\
PAS against a\\tb.json
system  saved      now  difference  95 % interval    change
x       0.75       0.5  -0.25       -0.25 to -0.25   worse
long\\n  1.235e+04  -    -           -                none that is certain
y       0          1    +1          +0.1235 to +2.5  better
first
second"""


def test_all_that_the_text_of_changes_has():
    systems = [
        {"system": "x", "saved": 0.75, "now": 0.5, "change": "worse", **exactly(-0.25)},
        {"system": "long\n", "saved": 12345.678, "now": None, "change": None, **exactly(None)},
        {"system": "y", "saved": 0.0, "now": 1.0, "change": "better"}
        | {"difference": 1.0, "low": 0.123456, "high": 2.5},
    ]
    found = Changes("a\tb.json", "PAS", ["first", "second"], systems)
    assert found.as_text() == CHANGED
