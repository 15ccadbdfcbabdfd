"""A comparison against a saved one, and conditions on which a build fails, by the command."""

import json
import re
import shutil

import pytest

SYSTEMS = {"orb": (0.1, 1.0, 1, 0.0), "dso": (0.1, 1.0, 1, 0.0)}
WORSE = {"orb": (0.3, 3.0, 1, 0.0), "dso": (0.1, 1.0, 1, 0.0)}


@pytest.fixture
def gate(run_compare, benchmark_of, tmp_path):
    """(what is done to the files in between, options, runs=, systems=) -> code, output, errors."""

    def gate(change, *options, fail_on="worse", runs=3, systems=SYSTEMS, first=()):
        patterns = benchmark_of(systems, n=60, runs=runs)
        common = *patterns, "--jobs", 1
        (tmp_path / "saved.json").write_text(run_compare(*common, "--json", *first)[1])
        change()
        gate = ("--fail_on", fail_on) if fail_on else ()
        return run_compare(*common, "--baseline", "saved.json", *gate, *options)

    return gate


def test_a_system_that_is_better_does_not_fail(gate, benchmark_of):
    code, out, _ = gate(lambda: benchmark_of(SYSTEMS, n=60), "--json", systems=WORSE)
    assert code == 0
    systems = {entry["system"]: entry for entry in json.loads(out)["baseline"]["systems"]}
    orb = systems["orb"]
    assert (orb["change"], orb["wins"], systems["dso"]["change"]) == ("better", 1, None)
    assert 0 < orb["low"] < orb["difference"] < orb["high"]
    assert orb["difference"] == pytest.approx(orb["now"] - orb["saved"])


def test_five_real_runs_that_are_all_worse_fail(real, run_compare, tmp_path):
    """And others of the same system do not."""
    runs, patterns = real / "euroc/V2_02", ("{sequence}/gt.txt", "{sequence}/{system}/{run}.txt")
    (tmp_path / "room/slam").mkdir(parents=True)
    shutil.copy(runs / "groundtruth.txt", tmp_path / "room/gt.txt")

    def compared(system, numbers, *options):
        for index, number in enumerate(numbers):
            shutil.copy(runs / system / f"{number}.txt", tmp_path / f"room/slam/{index}.txt")
        return run_compare(*patterns, "--jobs", 1, *options)

    (tmp_path / "saved.json").write_text(compared("vislam_ba", range(5), "--json")[1])
    gate = "--baseline", "saved.json", "--fail_on", "worse"
    code, _, err = compared("vislam_rp", range(5), *gate)
    assert (code, err.splitlines()[-1].endswith(", worse (p = 0.004)")) == (3, True)
    assert compared("vislam_ba", range(5, 10), *gate)[0] == 0


@pytest.fixture
def judge(run_compare, tmp_path):
    """(saved, now, options) -> code, output, errors of tables of runs: {system: its PAS}."""

    def write(name, systems):
        rows = [f"{a},{k},{pas}" for a, runs in systems.items() for k, pas in enumerate(runs)]
        (tmp_path / name).write_text("\n".join(["system,run,PAS", *rows]))

    def judge(saved, now, *options):
        write("saved.csv", saved)
        write("now.csv", now)
        return run_compare("now.csv", "--baseline", "saved.csv", *options)

    return judge


FIVE_WORSE = {"orb": [0.8, 0.81, 0.82, 0.83, 0.84]}, {"orb": [0.3, 0.31, 0.32, 0.33, 0.34]}


def test_a_gate_that_cannot_fail_is_an_error(judge):
    single = {"orb": [0.8], "dso": [0.5]}, {"orb": [0.3], "dso": [0.5]}
    code, out, err = judge(*single, "--fail_on", "worse")
    error = "no system could be shown to be worse at a level of 0.01: too few runs"
    assert (code, err) == (1, f"alignscores: error: {error}\n")
    reason = "worse cannot be significant at 0.01 with 1 against 1 runs (too few to test)"
    more = "; more runs are needed, or a higher level"
    for system in ("dso", "orb"):
        assert f"\n{system}: {reason}{more}\n" in out
    assert judge(*single)[0] == 0
    code, out, _ = judge(*FIVE_WORSE, "--fail_on", "worse:0.001")  # 1 / 252 is the least
    assert code == 1
    limit = "with 5 against 5 runs (p is at least 0.004)"
    assert f"orb: worse cannot be significant at 0.001 {limit}" in out


def test_who_is_worse_though_the_mean_is_better_is_named(judge):
    """Of runs that are all a little worse, but for one; p is of two systems."""
    saved = {system: [*(0.7 + 0.01 * k for k in range(9)), 0.1] for system in ("orb", "dso")}
    code, out, err = judge(saved, {**saved, "orb": [0.69] * 10}, "--fail_on", "worse")
    assert code == 3
    assert re.search(r"orb: PAS 0\.6760 to 0\.6900, worse \(adjusted p [<=] 0\.0\d+\), though", err)
    assert err.endswith(", though its mean is better\n")
    assert re.search(r"worse \(adjusted p .*\), though its mean is better", out)


def test_who_cannot_fail_is_named_where_others_can(judge):
    single = {"dso": [0.5]}
    saved, now = FIVE_WORSE
    code, out, err = judge(saved | single, now | single, "--fail_on", "worse")
    assert code == 3
    assert "orb: PAS 0.8200 to 0.3200, worse (p = 0.004)" in err
    assert "dso: worse cannot be significant at 0.01 with 1 against 1 runs (too few" in out


def test_values_and_drops_fail_with_one_run(run_compare, benchmark_of, tmp_path):
    for name, systems in (("saved.csv", SYSTEMS), ("now.csv", WORSE)):
        patterns = benchmark_of(systems, n=60, runs=1)
        (tmp_path / name).write_text(run_compare(*patterns, "--csv")[1])
    for fail_on, reasons in (
        ("PAS drops 0.05", ["orb: PAS"]),
        ("PAS drops 0.5", []),
        ("half rises 0.01, PAS<0.7", ["orb: PAS", "orb: half_distance"]),
        ("PAS<0.1,half>10,lost>5%,failed>0", []),
        ("TAS < 0.9", ["dso: TAS", "orb: TAS"]),
    ):
        code, _, err = run_compare("now.csv", "--baseline", "saved.csv", "--fail_on", fail_on)
        assert code == (3 if reasons else 0), fail_on
        if not reasons:
            assert err == f"alignscores: note: passed: {fail_on}\n"
            continue
        errors = [line.removeprefix("alignscores: error: ") for line in err.splitlines()]
        assert sorted(" ".join(line.split()[:2]) for line in errors) == reasons


def test_a_value_needs_no_baseline(patterns, run):
    code, _, err = run(*patterns, "--fail_on", "PAS<0.1")
    assert (code, "passed" in err) == (1, False)  # a run is missing
    code, _, err = run(*patterns, "--fail_on", "failed>0, half>10")
    assert code == 3
    assert err.splitlines()[-2:] == [
        "alignscores: error: c: failed 16.67% > 0%",
        "alignscores: error: c: half_distance ∞ > 10",
    ]
    name = "recall@5cm,5deg:hloc"  # with a comma
    code, _, err = run(*patterns, "--metrics", name, "--fail_on", f"{name}<99,PAS<0.1")
    assert (code, err.count("5deg:hloc 0.0000 < 99")) == (3, 2)


@pytest.mark.parametrize(
    ("fail_on", "message"),
    [
        ("worse", "worse: needs --baseline FILE"),
        ("worse:2", "'worse:2': the level of worse must be above 0 and below 1"),
        ("better", "'better' must be worse, or like PAS<0.8, half>0.1, lost>5%, PAS drops 0.05"),
        ("PAS drops 5%", "'PAS drops 5%': only lost and failed are in per cent; write 0.05"),
        ("PAS<much", "'PAS<much' must be worse, or like PAS<0.8"),
        ("ate:rmse>1", "'ate:rmse>1': ate:rmse must be one of TAS, RAS, PAS"),
        ("PAS drops 2", "'PAS drops 2' decides nothing: a change of PAS is from 0 to 1"),
        ("half rises -1", "'half rises -1' decides nothing: a change of half_distance is at least"),
        ("PAS<80", "'PAS<80' decides nothing: PAS is from 0 to 1"),
        ("PAS>1", "'PAS>1' decides nothing"),
        ("half<0", "'half<0' decides nothing: half_distance is at least 0"),
        ("lost>5", "'lost>5' decides nothing: lost is from 0 to 1"),
        ("failed>100%", "'failed>100%' decides nothing"),
    ],
)
def test_wrong_conditions_are_named_in_one_line(patterns, run, fail_on, message):
    code, out, err = run(*patterns, "--fail_on", fail_on)
    assert (code, out) == (2, "")
    assert f"argument --fail_on: {message}" in err


def test_runs_that_fail_or_are_gone_fail_the_build(gate, tmp_path):
    def fail():
        for file in tmp_path.glob("*/orb/*.txt"):
            file.write_text("nothing")
        shutil.rmtree(tmp_path / "car/dso")

    code, _, err = gate(fail)
    assert code == 3
    assert "orb: PAS 0.8" in err
    assert " to 0.0000, worse (p = " in err
    assert "alignscores: error: gone: dso on car\n" in err


def test_what_is_new_or_gone_is_named(gate, tmp_path):
    def change():
        shutil.move(tmp_path / "car/dso", tmp_path / "car/lsd")
        shutil.rmtree(tmp_path / "helix")

    code, out, _ = gate(change, fail_on=None)
    assert code == 0
    assert "\nnew: lsd on car\ngone: dso on car, dso on helix, orb on helix\n" in out


def test_a_broken_baseline_is_refused_in_one_line(patterns, run, tmp_path):
    saved = json.loads(run(*patterns, "--json")[1])
    saved["runs"][0]["PAS"] = "high"
    refusal = "saved.json: has no table of runs, as --save_csv and --save_json write"
    wrong = "saved.json: column 'PAS' of the table of runs is not numeric"
    for content, message in (
        ("nonsense", refusal),
        ('{"runs": 7}', refusal),
        (json.dumps(saved), wrong),
    ):
        (tmp_path / "saved.json").write_text(content)
        ended = run(*patterns, "--baseline", "saved.json")
        assert ended == (1, "", f"alignscores: error: {message}\n")
    assert "none.json: cannot be read (No such" in run(*patterns, "--baseline", "none.json")[2]


def test_other_settings_do_not_compare(gate, run_compare):
    code, out, err = gate(lambda: None, "--registration", "pcr99")
    assert (code, out) == (1, "")
    assert "saved.json: the baseline used default settings, this run registration=pcr99 (" in err
    patterns = "tum", "{sequence}/gt.txt", "{sequence}/{system}/{run}.txt"
    code, _, _ = run_compare(*patterns, "--baseline", "saved.json", "--reference_sigma", "0.1,1")
    assert code == 0  # no score depends on it


def test_rotations_that_a_build_leaves_out_count_as_the_worst(gate, tmp_path):
    """And so do runs: who keeps the good ones does not pass."""

    def drop_rotations():
        for file in tmp_path.glob("*/orb/*.txt"):
            rows = [line.split()[:4] for line in file.read_text().splitlines()]
            file.write_text("\n".join(" ".join([*row, *4 * ["nan"]]) for row in rows))

    code, _, err = gate(drop_rotations)
    assert code == 3
    assert "orb: PAS 0.8" in err
    assert " to 0.0000, worse (adjusted p = " in err

    def drop_runs():
        for file in tmp_path.glob("*/dso/2.txt"):
            file.unlink()

    code, _, err = gate(drop_runs)
    assert code == 3
    assert "gone: dso on car (2 of 3 runs left)" in err
