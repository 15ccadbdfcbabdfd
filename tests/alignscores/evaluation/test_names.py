"""Names in the output: short, unique, and no result is lost for one that cannot be printed."""

import json
import os
import shutil

import pytest

from alignscores.evaluation.names import unique_names

NAMES = os.fsdecode(b"n\xff\xe9.txt"), "gr\u00fc\u00df.txt", "a\n\x1b[2J.txt", "a$\\bad$.txt"


def test_names():
    assert unique_names(["x/a.txt", "x/b.txt"]) == ["a.txt", "b.txt"]
    assert unique_names(["x/a", "y/a", "z/x/a"]) == ["x/a", "y/a", "z/x/a"]
    assert unique_names(["a", "a", "x/a"]) == ["a", "a (2)", "x/a"]
    assert unique_names(["/a", "a"]) == ["/a", "a"]


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_a_name_that_cannot_be_printed_loses_no_result(process, examples, tmp_path, encoding):
    files = [str(shutil.copy(examples / "tum/estimate.txt", tmp_path / name)) for name in NAMES]

    def run(*arguments):
        strict = {"PYTHONIOENCODING": f"{encoding}:strict"}
        command = "tum", "tum/reference.txt", *files, "--repeat", "2", *arguments
        return process(*command, before="pass", **strict)

    # What is in files does not depend on the encoding of what is printed.
    saved = ["--save_plot", str(tmp_path / "a.svg")] if encoding == "ascii" else []
    done = run(*saved, "--save_results", str(tmp_path / "r.zip"))
    assert (done.returncode, done.stderr) == (0, "")
    assert len(done.stdout.splitlines()) == 1 + len(NAMES) + 5
    assert done.stdout.replace("\n", "").isprintable()
    assert "\n" + r"n\xff\xe9.txt " in done.stdout
    assert len(list(tmp_path.glob("r_*.zip"))) == len(NAMES)
    files.append(str(tmp_path / NAMES[0] / NAMES[1]))
    done = run("--json")
    assert done.returncode == 1
    printed = json.loads(done.stdout)
    assert len(printed["results"]) == len(NAMES)
    assert r"n\xff\xe9.txt" in [one["name"] for one in printed["results"]]
    texts = [value for one in printed["results"] for value in (one["name"], one["file"])]
    for text in (*texts, *printed["failed"][0].values()):
        assert text.isprintable()
