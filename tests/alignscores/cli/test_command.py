"""From arguments to what is printed: the format that is not named, progress, and streams."""

import json
import sys
from io import BytesIO, TextIOWrapper

import pytest

from alignscores import progress
from alignscores.cli import command, main
from alignscores.cli.command import with_format, with_signed_axes

TUM = "tum", "tum/reference.txt", "tum/estimate.txt"


@pytest.mark.parametrize(
    ("given", "taken"),
    [
        ("tum a b --up -y", "tum a b --up=-y"),
        ("--up x --up -z a", "--up=x --up=-z a"),
        ("tum x y --seed -y z", "tum x y --seed -y z"),
        ("tum a --up", "tum a --up"),
        ("--up", "--up"),
        ("", ""),
    ],
)
def test_an_axis_is_joined_to_its_option_alone(given, taken):
    """A file may have the name of an axis."""
    assert with_signed_axes(given.split()) == taken.split()


@pytest.mark.parametrize(
    ("given", "taken", "note"),
    [
        (
            "tum/reference.txt tum/estimate.txt --seed 1",
            "tum tum/reference.txt tum/estimate.txt --seed 1",
            "taken for the format tum",
        ),
        (
            "euroc/data.csv euroc/estimate.txt euroc/estimate.txt",
            "euroc euroc/data.csv euroc/estimate.txt euroc/estimate.txt --est_format=tum",
            "taken for the format euroc; euroc/estimate.txt for tum",
        ),
        ("tum/reference.txt --json", "tum/reference.txt --json", None),
        ("none none.txt", "none none.txt", None),
        ("tum tum/reference.txt", "tum tum/reference.txt", None),
        ("compare tum/reference.txt", "compare tum/reference.txt", None),
    ],
)
def test_the_format_stands_before_the_files(examples, monkeypatch, capsys, given, taken, note):
    monkeypatch.chdir(examples)
    assert with_format(given.split()) == taken.split()
    assert capsys.readouterr().err == (f"alignscores: note: {note}\n" if note else "")


@pytest.mark.parametrize(
    ("files", "message"),
    [
        (
            ["tum/reference.txt", "kitti/estimate.txt"],
            "tum/reference.txt is in the format tum, kitti/estimate.txt in kitti: no match",
        ),
        (
            ["tum/reference.txt", "tum/estimate.txt", "kitti/estimate.txt"],
            "kitti/estimate.txt: is not in the format of tum/estimate.txt, tum; score it apart",
        ),
    ],
)
def test_files_of_several_formats_are_refused(run, files, message):
    assert run(*files) == (1, "", f"alignscores: error: {message}\n")


def test_progress_names_each_estimate_and_what_takes_long(run, monkeypatch):
    """Each replaces the last one, and at the end the line is empty."""
    score = command.score

    def slow(*arguments, **options):
        progress.show.get()("half of it")
        return score(*arguments, **options)

    monkeypatch.setattr(command, "score", slow)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    shown = [
        f"{name} {what}"
        for name in ("1/2 estimate.txt", "2/2 reference.txt")
        for what in ("", "half of it")
    ]
    code, _, err = run(*TUM, TUM[1])
    assert code == 0
    assert err == "".join(f"\r\x1b[K{text}" for text in [*shown, ""])
    err = run(*TUM)[2]
    assert err == "\r\x1b[K\r\x1b[Khalf of it\r\x1b[K"  # one alone needs no name


class Terminal(BytesIO):
    """What has come out of a buffer."""

    def isatty(self):
        return True


@pytest.mark.parametrize("option", ["--json", "--seed=0"])
def test_what_is_printed_has_left_the_buffers(examples, monkeypatch, write, lines, option):
    """On an output that cannot encode all names, which are escaped there."""
    path, out, err = write(lines, "é.txt"), Terminal(), Terminal()
    monkeypatch.chdir(examples)
    monkeypatch.setattr(sys, "stdout", TextIOWrapper(out, "ascii"))
    monkeypatch.setattr(sys, "stderr", TextIOWrapper(err, "utf-8", line_buffering=True))
    assert main([*TUM[:2], str(path), option]) == 0
    if option == "--json":
        assert json.loads(out.getvalue())["results"][0]["name"] == "é.txt"
    else:
        assert out.getvalue().splitlines()[1].startswith(rb"\xe9.txt ")
    assert err.getvalue().endswith(b"\r\x1b[K")
