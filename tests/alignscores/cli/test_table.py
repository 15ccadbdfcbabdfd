"""The table stays narrow, and says what it can."""

import numpy as np
import pytest

from alignscores import Settings
from alignscores.cli.output import footnotes
from alignscores.cli.table import COLUMNS, shortened, table

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


def test_names_are_cut_to_next_to_nothing():
    """Of characters that take two columns none may fit."""
    assert shortened(["abcdef"], 2) == [".."]
    assert shortened(["\u65e5" * 9], 3) == [".."]


def test_long_names_keep_what_tells_them_apart():
    names = [f"results_of_a_long_study_{i}_trajectory_after_optimisation_final.txt" for i in (1, 2)]
    lines = table([ROW | {"name": name} for name in names], METRES, 90)[0].splitlines()
    assert [line.split()[0] for line in lines[1:]] == ["..1..", "..2.."]


def test_a_name_that_fits_is_none_of_those_that_are_cut():
    names = [f"{20 * 'x'}{number}{20 * 'y'}" for number in "12"]
    assert shortened([*names, "abcdefghijkl"], 12) == ["..1..", "..2..", "abcdefghijkl"]


def test_of_a_long_name_the_beginning_and_the_end_are_left():
    assert shortened(["abcdefghijklmnopqrstuvwxyz"], 12) == ["abcde..vwxyz"]


def test_a_narrow_terminal_drops_columns_and_says_so():
    row = ROW | {"rank": [1, 1], "no_position": 1, "duplicate": 1}
    text, dropped = table([row | {"name": f"orb_slam{n}.txt"} for n in (2, 3)], METRES, 40)
    assert max(map(len, text.splitlines())) <= 40
    assert text.split()[:4] == ["estimate", "TAS", "RAS", "PAS"]
    assert dropped == [
        *("< 10 deg", "< d", "dupl.", "sd", "nan", "sd", "ATE m", "d m", "n", "half deg"),
        *("half m", "rank"),
    ]


def test_long_names_of_which_two_differ_in_the_middle_are_numbered():
    names = ["x" * 80 + i + "x" * 80 for i in "ab"] + ["y" * 161]
    lines = table([ROW | {"name": name} for name in names], NO_UNIT)[0].splitlines()
    assert [line.split()[0][-4:] for line in lines[1:]] == ["xx~1", "xx~2", "yy~3"]
    assert max(map(len, lines)) <= 100


def test_one_estimate_with_missing_cameras_has_both_standard_deviations():
    row = ROW | {"name": "estimate.txt", "lost": 0.2, "ATE": 1.03, "unit": 0.6463}
    header, line = table([row], METRES)[0].splitlines()
    expected = "estimate TAS sd half m RAS half deg PAS sd ATE m d m n lost"
    assert header.split() == expected.split()
    assert line.split()[2] == line.split()[7] == "0.0082"  # two digits say how far to trust a mean


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
    lost = [table([ROW | {"lost": share}], ignored)[0].count("*") for share in (0.1, 0.11)]
    assert lost == [0, 2]
    just = ROW | {"name": "just.txt", "lost": 0.1}
    assert table([just], ignored) == table([just], METRES)  # no room is taken by a mark
    _, *rows = table([just, both[1]], ignored)[0].splitlines()
    assert [row.count("*") for row in rows] == [0, 2]
    said = footnotes([row | {"scale": 1.0} for row in both], ignored, header)
    assert "* without what the estimate lost; --missing fail counts it" in said


def test_a_number_of_eight_characters_is_written_out():
    assert "0.008191" in table([ROW], NO_UNIT)[0]
    assert "8.19e-05" in table([ROW | {"ATE": 0.00008191}], NO_UNIT)[0]


def test_whole_table():
    """Numbers stand to the right, a standard deviation close to its score."""
    first = {
        **{"name": "orb.txt", "rank": [1, 2], "n": 40, "lost": 0.025, "duplicate": 0, "parts": []},
        **{"no_position": 2, "no_rotation": 1, "TAS": 0.5, "TAS_sd": 0.00123, "RAS": 1.0},
        **{"PAS": 0.75, "PAS_sd": None, "half_distance": 0.12345, "half_angle": None},
        **{"ATE": 12345.678, "unit": 0.25, "within_unit": 0.456, "within_10_deg": 1.0},
    }
    second = first | {"name": "dso", "rank": [3, 3], "TAS_sd": None, "n": 7, "parts": [1, 2, 3]}
    assert table([first, second], METRES, 200) == (
        """\
estimate  rank     TAS     sd  half m     RAS  half deg     PAS     ATE m   d m  < d  < 10 deg   n\
  lost  nan  parts
orb.txt    1-2  0.5000 0.0012  0.1235  1.0000         -  0.7500  1.23e+04  0.25  46%      100%  40\
  2.5%  2/1      0
dso          3  0.5000      -  0.1235  1.0000         -  0.7500  1.23e+04  0.25  46%      100%   7\
  2.5%  2/1      3""",
        [],
    )


def test_a_column_stays_where_there_is_just_room_for_it():
    """Long names are cut to twelve characters before any but the least important ones go."""
    rows = [ROW | {"name": name * 20, "duplicate": 1} for name in "ab"]
    width = len(table(rows, METRES, 1000)[0].splitlines()[0])
    assert table(rows, METRES, width)[1] == []
    # What each column takes, with the gap before it.
    first = [("< 10 deg", 10), ("< d", 5), ("dupl.", 7), ("sd", 7)]
    gone = []
    for name, wide in first:
        assert table(rows, METRES, width)[1] == gone
        gone = [*gone, name]
        assert table(rows, METRES, width - 1)[1] == gone
        width -= wide
    assert table(rows, METRES, width - 8)[1] == gone  # by as much as the names are cut
    assert table(rows, METRES, width - 9)[1] == [*gone, "sd"]
    lines = table(rows, METRES, width - 8)[0].splitlines()
    assert {len(line) for line in lines} == {width - 8}
    assert lines[1].startswith("aaaaa..aaaaa ")
