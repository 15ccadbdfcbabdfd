"""Names in the output: short, unique, and no result is lost for one that cannot be printed."""

import json
import os
import shutil
import sys
from contextlib import redirect_stdout
from io import BytesIO, TextIOWrapper

import pytest

NAMES = os.fsdecode(b"n\xff\xe9.txt"), "gr\u00fc\u00df.txt", "a\n\x1b[2J.txt", "a$\\bad$.txt"


@pytest.mark.skipif(sys.platform != "linux", reason="files have no such names")
@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_a_name_that_cannot_be_printed_loses_no_result(run, examples, tmp_path, encoding):
    files = [str(shutil.copy(examples / "tum/estimate.txt", tmp_path / name)) for name in NAMES]

    def printed(*arguments):
        stdout = TextIOWrapper(BytesIO(), encoding, errors="strict")
        with redirect_stdout(stdout):
            code, _, err = run("tum", "tum/reference.txt", *files, *arguments)
        stdout.seek(0)
        return code, stdout.read(), err

    # What is in files does not depend on the encoding of what is printed.
    saved = ["--save_plot", str(tmp_path / "a.svg")] if encoding == "ascii" else []
    code, out, err = printed(*saved, "--save_results", str(tmp_path / "r.zip"))
    assert (code, err) == (0, "")
    assert all(path.read_text().startswith("<?xml") for path in tmp_path.glob("a.svg"))
    assert out.count("%") == len(NAMES)  # a row each
    assert out.replace("\n", "").isprintable()
    assert "\n" + r"n\xff\xe9.txt " in out
    assert len(list(tmp_path.glob("r_*.zip"))) == len(NAMES)
    files.append(str(tmp_path / NAMES[0] / NAMES[1]))
    code, out, _ = printed("--json")
    assert code == 1
    (results, failed) = (json.loads(out)[key] for key in ("results", "failed"))
    assert len(results) == len(NAMES)
    folder, name = results[0]["name"].split("/")  # like the file in a folder
    assert (folder, name) == (tmp_path.name, r"n\xff\xe9.txt")
    texts = [value for result in results for value in (result["name"], result["file"])]
    for text in (*texts, *failed[0].values()):
        assert text.isprintable()
