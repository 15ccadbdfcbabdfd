"""Files of YAML from anybody: what is read, and that nothing else ends in more than a line."""

import pytest

from alignscores.texts import brief, first_few
from alignscores.yaml_files import load_yaml

BOMB = "a0: &a0 [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"a{n}: &a{n} [{','.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 9)
)
MERGED = "a0: &a0 {x: 1}\n" + "".join(
    f"a{n}: &a{n} {{<<: [{','.join([f'*a{n - 1}'] * 9)}]}}\n" for n in range(1, 9)
)
HOSTILE = [
    ("[" * 30_000, "nested more than 20 deep"),
    ("a:\n" + "".join(" " * n + "- \n" for n in range(1, 900)), "nested more than 20 deep"),
    ("- " * 30_000, "nested more than 20 deep"),
    ("{a: " * 900 + "1" + "}" * 900, "nested more than 20 deep"),
    (BOMB, "more than 100000 entries"),
    (MERGED, "more than 100000 entries"),
    ("a: &a [*a]", r"line 1: \*a names nothing before it"),
    ("a: *b", r"line 1: \*b names nothing before it"),
    ("a: !!int [1]", "line 1: a tag, tag:yaml.org,2002:int, is not taken"),
    ("a: !!int x", "a tag"),
    ("a: !!float x", "a tag"),
    ("a: !!bool x", "a tag"),
    ("b: 1\na: !!timestamp x", "line 2: a tag"),
    ("a: !!python/object:os.system x", "a tag"),
    (f"a: {'9' * 400}", "line 1: a number has 400 characters"),
    (f"a: {'9' * 5000}", "a number has 5000 characters"),
    (f"a: {'1:' * 400}1", "a number has 801 characters"),
    (f"a: 0x{'f' * 400}", "a number has 402 characters"),
    ("a: 9999999999999999999999", "is too large a number"),
    ("a: 1e400", "1e400 is too large a number"),
    ("a: 0x_", "'0x_' is not a number"),
    ("b: 1\na: 1\nb: 2", "line 3: 'b' is given twice"),
    ("0x10: 1\n16: 2", "line 2: '16' is given twice"),
    ("true: 1\nTrue: 2", "line 2: 'True' is given twice"),
    ("a: &a 1\nb: &a 2", "line 2: &a is given twice"),
    ("a: &a {k: 1}\nb: {<<: *a, <<: *a}", "line 2: '<<' is given twice"),
    ("a: &a {k: 1, k: 2}\nb: {<<: *a}", "line 1: 'k' is given twice"),
    ("[a]: 1", "line 1: a key must be a text or a number"),
    ("{a: 1}: 1", "line 1: a key must be a text or a number"),
    ("a: 1\n---\nb: 2", "line 2: but found another document"),
    ("a: [", "line "),
    ("\x07", "."),
    ("x" * 1_000_001, "more than 1 MB"),
    (b"a: \xff\xfe", r"line 1 is not text \(UTF-8\)"),
    (b"\xff\xfea\0:\0", r"is not text \(UTF-8\)"),
]


@pytest.mark.parametrize(("text", "reason"), HOSTILE)
def test_hostile_files_are_a_line_each(tmp_path, text, reason):
    path = tmp_path / "x.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ValueError, match=reason) as caught:
        load_yaml(path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 200


def test_what_is_no_file_is_a_line(tmp_path):
    with pytest.raises(ValueError, match="No such file"):
        load_yaml(tmp_path / "none.yaml")
    with pytest.raises(ValueError, match="Is a directory"):
        load_yaml(tmp_path)
    with pytest.raises(ValueError, match="more than 1 MB"):
        load_yaml("/dev/zero")


@pytest.mark.parametrize(
    ("text", "content"),
    [
        ("", None),
        ("a: 1e-3\nb: -2E5\nc: .5\nd: -3", {"a": 1e-3, "b": -2e5, "c": 0.5, "d": -3}),
        ("a: 2011-09-26\nb: 2024-13-45", {"a": "2011-09-26", "b": "2024-13-45"}),
        ("a: &x [1, 2]\nb: *x", {"a": [1, 2], "b": [1, 2]}),
        ("a: &x {k: 1}\nb: {<<: *x, l: 2}", {"a": {"k": 1}, "b": {"k": 1, "l": 2}}),
        (
            "a: &a {k: 1}\np: {q: &x {<<: *a, k: 2}}\nc: {<<: *x}",
            {"a": {"k": 1}, "p": {"q": {"k": 2}}, "c": {"k": 2}},
        ),
        ("a: &x 1\nb: [*x, *x]", {"a": 1, "b": [1, 1]}),
        ("a: =\nb: <<", {"a": "=", "b": "<<"}),
        ("\ufeffa: Zürich\nb: 日本", {"a": "Zürich", "b": "日本"}),
        ("a: .inf\nb: ~\nc: true", {"a": float("inf"), "b": None, "c": True}),
    ],
)
def test_ordinary_files(tmp_path, text, content):
    path = tmp_path / "x.yaml"
    path.write_bytes(text.encode())
    assert load_yaml(path) == content


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("a", "'a'"),
        ("a" * 10**6, f"'{'a' * 59}..."),
        ([1, 2], "[1, 2]"),
        (list(range(9)), "[0, 1, 2, 3, 4 and 4 more]"),
        ({"a": [[1]], "b": {}}, "{'a': [[...]], 'b': {}}"),
        (dict.fromkeys("abcdefg", 1), "{'a': 1, 'b': 1, 'c': 1, 'd': 1, 'e': 1 and 2 more}"),
        (None, "None"),
    ],
)
def test_values_in_messages_are_short(value, text):
    assert brief(value) == text


def test_lists_in_messages_are_short():
    assert first_few(["a", "b"]) == "a, b"
    assert first_few(list("abcdefg")) == "a, b, c, d, e and 2 more"
