"""A comparison against a saved one, by the command."""

import json
import shutil

import numpy as np
import pytest

SYSTEMS = {"orb": (0.1, 1.0, 1, 0.0), "dso": (0.1, 1.0, 1, 0.0)}
WORSE = {"orb": (0.3, 3.0, 1, 0.0), "dso": (0.1, 1.0, 1, 0.0)}


@pytest.fixture
def gate(run_compare, benchmark_of, tmp_path):
    """(what is done to the files in between, options) -> exit code, output, errors."""

    def gate(change, *options, first=(), systems=SYSTEMS):
        patterns = benchmark_of(systems, n=60)
        common = *patterns, "--jobs", 1, "--no_cache"
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
    code, out, err = run_compare("tum", *patterns, "--baseline", file, "--no_cache")
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
