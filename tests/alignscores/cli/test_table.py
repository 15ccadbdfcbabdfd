"""The table stays narrow, and says what it can."""

import numpy as np
import pytest

from alignscores import Settings
from alignscores.cli.table import COLUMNS, table

ROW = {key: 0.008191 for _, key, form in COLUMNS if form[-1] in "f%g"}
ROW |= {"name": "orb.txt", "rank": [1, 1], "n": 4541}
ROW |= {"parts": [], "lost": 0.0, "no_position": 0, "no_rotation": 0, "duplicate": 0}
METRES, NO_UNIT = Settings(format="tum"), Settings(format="nerf")


def test_columns_that_say_nothing_are_left_out():
    header = table([ROW], NO_UNIT)[0].splitlines()[0]
    assert header.split()[-1] == "n"
    assert "rank" not in header
    rows = [ROW | {"name": name, "unit": 0.1, "lost": 0.03} for name in ("orb.txt", "dso.txt")]
    header = table(rows, METRES)[0].splitlines()[0]
    assert header.split()[:2] == ["estimate", "rank"]
    assert header.split()[-2:] == ["n", "lost"]


@pytest.mark.parametrize("length", [5, 30, 60, 200])
@pytest.mark.parametrize("failures", [0, 1000])
def test_width(length, failures):
    rows = [
        ROW
        | {"name": "ab"[i] + "x" * length + "yz"[i], "rank": [10, 1000]}
        | dict.fromkeys(("no_position", "no_rotation", "duplicate"), failures)
        | {"lost": failures / 1000}
        for i in (0, 1)
    ]
    header, *lines = table(rows, METRES)[0].splitlines()
    assert max(map(len, [header, *lines])) <= 100
    for key in ("TAS", "RAS", "PAS", "ATE", "d", "n"):
        assert key in header.split()
    assert header.split().count("half") == 2
    # That of the PAS is the first that is no more; what was lost comes before that of the TAS.
    assert header.split().count("sd") == (0 if failures else 1)
    assert ("lost" in header.split()) == bool(failures)
    assert lines[0].startswith("ax")
    assert lines[0].split()[0][-1] == "y"
    assert len({line.split()[0] for line in lines}) == 2


def test_long_names_keep_what_tells_them_apart():
    names = [f"results_of_a_long_study_{i}_trajectory_after_optimisation_final.txt" for i in (1, 2)]
    lines = table([ROW | {"name": name} for name in names], METRES, 90)[0].splitlines()
    assert [line.split()[0] for line in lines[1:]] == ["..1..", "..2.."]


def test_long_names_of_which_two_differ_in_the_middle_are_numbered():
    names = ["x" * 80 + i + "x" * 80 for i in "ab"] + ["y" * 161]
    lines = table([ROW | {"name": name} for name in names], NO_UNIT)[0].splitlines()
    assert [line.split()[0][-4:] for line in lines[1:]] == ["xx~1", "xx~2", "yy~3"]
    assert max(map(len, lines)) <= 100


def test_width_of_any_numbers_and_names():
    numbers = np.random.default_rng(0)
    for _ in range(300):
        exponents = numbers.uniform(-12, 9, size=(2, 5))
        rows = [
            ROW
            | dict(
                zip(
                    ("half_distance", "half_angle", "ATE", "unit", "TAS_sd"), 10.0**own, strict=True
                )
            )
            | {"name": name * 20, "rank": [997, 1000], "n": 123456, "lost": 0.5}
            | {"parts": [None] * 12, "no_position": 3, "duplicate": 7}
            for name, own in zip(("ab", "軌跡"), exponents, strict=True)
        ]
        lines = table(rows, METRES)[0].splitlines()
        widths = {len(line) + sum(ord(letter) > 0x3000 for letter in line) for line in lines}
        assert len(widths) == 1
        assert widths.pop() <= 100
        assert all(".." in line.split()[0] for line in lines[1:])


def test_numbers_without_a_value():
    none = dict.fromkeys(("ATE", "TAS_sd", "PAS_sd", "half_distance", "half_angle"))
    header, line = table([ROW | none], NO_UNIT)[0].splitlines()
    assert "sd" not in header.split()  # where no score has one
    assert [line.split()[column] for column in (2, 4, 6)] == ["-"] * 3
    line = table([ROW, ROW | none], NO_UNIT)[0].splitlines()[2]
    assert [line.split()[column] for column in (3, 4, 6, 8)] == ["-"] * 4


def test_the_score_of_a_track_that_lost_much_is_marked():
    both = [ROW, ROW | {"name": "dso.txt", "lost": 0.4}]
    ignored = Settings(format="tum", missing="ignore")
    header, *rows = table(both, ignored)[0].splitlines()
    assert [row.count("*") for row in rows] == [0, 2]
    assert len({len(line) for line in (header, *rows)}) == 1
    assert "*" not in table(both, METRES)[0]  # where what was lost counts
