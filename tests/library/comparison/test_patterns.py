"""Patterns with named fields."""

import os

import pytest

from alignscores.comparison.patterns import Pattern

FIELDS = "sequence", "system", "run"


@pytest.mark.parametrize(
    ("pattern", "path", "values"),
    [
        ("{sequence}/{system}_{run}.txt", "a/b_1.txt", ("a", "b", "1")),
        ("{sequence}/{system}_{run}.txt", "a/orb_slam_1.txt", ("a", "orb_slam", "1")),
        ("{sequence}/x_{sequence}_{system}.txt", "a/x_a_b.txt", ("a", "b")),
        ("{sequence}/x_{sequence}_{system}.txt", "a/x_c_b.txt", None),
        ("./[0]*/{system}.txt", "./[0]x/b.txt", ("b",)),
        ("{sequence}/{system}.txt", "a/b/c.txt", None),
        ("{system}.txt", "a\nb.txt", ("a\nb",)),
        ("{system}_*.txt", "a_.txt", ("a",)),
        ("{system}.txt", "axtxt", None),
    ],
)
def test_the_fields_of_a_pattern_are_read_from_paths(tmp_path, monkeypatch, pattern, path, values):
    monkeypatch.chdir(tmp_path)
    (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / path).touch()
    matches = Pattern(pattern, FIELDS).find()
    assert {file: tuple(fields.values()) for file, fields in matches.items()} == (
        {path: values} if values else {}
    )


@pytest.mark.skipif(os.name != "posix", reason="needs devices")
def test_devices_never_match(tmp_path):
    """Nor does a link to one; a broken link is a file that cannot be read."""
    (tmp_path / "null").symlink_to("/dev/null")
    (tmp_path / "broken").symlink_to("nowhere")
    assert list(Pattern(f"{tmp_path}/{{system}}", FIELDS).find()) == [f"{tmp_path}/broken"]


@pytest.mark.parametrize(
    ("pattern", "reason"),
    [
        ("{scene}/gt.txt", r"has a field \{scene\}; it may have \{sequence\}$"),
        ("{sequence/gt.txt", r"^the pattern \{sequence/gt\.txt has a brace without its partner$"),
        ("{sequence}/*a*a*a*a*a*", "more than 4 \\* between two slashes"),  # could take for ever
    ],
)
def test_wrong_patterns(pattern, reason):
    with pytest.raises(ValueError, match=reason):
        Pattern(pattern, ["sequence"])
