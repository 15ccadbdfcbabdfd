"""Files of YAML: what is read, and that all else ends in one line."""

import pytest

from alignscores.yaml_files import load_yaml


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (b"[" * 1000, "nested too deeply"),
        (b"a: 1\nb: *b", "found undefined alias 'b'.*line 2"),
        (b"a: !!python/object:os.system x", "could not determine a constructor"),
        (b"a: " + b"9" * 5000, "4300 digits"),
        (b"a: 2024-13-45", "month"),
        (b"a: [", "line 1"),
        *((f"a: !!{tag}".encode(), "type") for tag in ("bool x", "int ''", "timestamp ''")),
        (b"\x07", "special characters are not allowed"),
        (b"a: \xff\xfe", "invalid start byte"),
        (b"x" * 1_000_001, "more than 1 MB"),
    ],
)
def test_bad_files_are_a_line_each(tmp_path, text, reason):
    path = tmp_path / "x.yaml"
    path.write_bytes(text)
    with pytest.raises(ValueError, match=reason) as caught:
        load_yaml(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_a_file_with_aliases_and_any_letters(tmp_path):
    path = tmp_path / "x.yaml"
    path.write_bytes("\ufeffa: &x {k: 1.5}\nb: {<<: *x, l: 日本}\nc: ~".encode())
    assert load_yaml(path) == {"a": {"k": 1.5}, "b": {"k": 1.5, "l": "日本"}, "c": None}
