"""Wrong input, in whatever form, gets one line that names file, place and remedy.

One table. A case is an example's file, spoilt: its format; which file it is, reference, estimate or
frames; how its lines, its content or its folder are edited; and what is said.
"""

import re
import shutil

import pytest

FILES = {
    "tum": ("tum/reference.txt", "tum/estimate.txt"),
    "kitti": ("kitti/reference.txt", "kitti/estimate.txt"),
    "euroc": ("euroc/data.csv", "euroc/estimate.txt"),
    "colmap": ("colmap/reference", "colmap/estimate"),
    "nerf": ("nerf/reference.json", "nerf/estimate.json"),
}


def clock(factor, start=1_700_000_000):
    """Stamps that count units of time, so many a second, from a start."""

    def edit(lines):
        edited = []
        for line in lines:
            stamp, rest = re.fullmatch(r"([\d.]*)(.*)", line).groups()
            if stamp:
                seconds = float(stamp) / (1 if "." in stamp else 1e9) - start
                stamp = f"{seconds * factor:.6f}"
            edited.append(stamp + rest)
        return edited

    return edit


SECONDS = "write them in seconds"
CASES = {  # (format, which file, edit): message
    "clock": [
        (form, whose, clock(factor, start), message)
        for form in ("tum", "euroc")
        for whose in ("reference", "estimate", "frames")
        for factor, start, message in (
            (1e3, 0, rf"bad: its time stamps seem to be in milliseconds .*; {SECONDS}"),
            (1e6, 0, rf"bad: its time stamps seem to be in microseconds .*; {SECONDS}"),
            (1e3, 1.7e9, rf"those of the {whose} seem to be in milliseconds: {SECONDS}"),
            (1e6, 1.7e9, rf"those of the {whose} seem to be in microseconds: {SECONDS}"),
        )
    ],
    "clock from a start": [
        (form, whose, clock(1, 1.7e9), message)
        for form in ("tum", "euroc")
        for whose, message in (
            ("reference", "the reference seem to count from its start: --t_offset auto finds"),
            ("estimate", "the estimate seem to count from its start: --t_offset auto finds the"),
            ("frames", r"no due frame has a reference pose: the frames go from 0.0\d* to 3.9"),
        )
    ],
    "clock in ns": [
        ("tum", whose, clock(1e9, start), rf"seem to be in nanoseconds .*; {SECONDS}$")
        for whose in ("reference", "estimate")
        for start in (0, 1.7e9)
    ],
}


@pytest.fixture
def spoilt(examples, tmp_path):
    """(file, edit) -> path of the file after the edit of its lines, content or folder."""

    def spoilt(file, edit):
        path = tmp_path / "bad"
        if (examples / file).is_dir():
            shutil.copytree(examples / file, path)
            edit(path)
            return path
        content = edit((examples / file).read_text().splitlines())
        content = "\n".join(content) if isinstance(content, list) else content
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return spoilt


@pytest.mark.parametrize(
    ("form", "whose", "edit", "message"),
    [
        pytest.param(*case, id=f"{name}-{case[0]}-{i}")
        for name in CASES
        for i, case in enumerate(CASES[name])
    ],
)
def test_one_line_names_what_is_wrong(run, spoilt, form, whose, edit, message):
    files = dict(zip(("reference", "estimate"), FILES[form], strict=True))
    bad = spoilt(files.get(whose, files["estimate"]), edit)
    options = ("--frames", bad) if whose == "frames" else ()
    files[whose] = bad
    code, out, err = run(form, files["reference"], files["estimate"], *options)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert err.startswith("alignscores: error: ")
    assert re.search(message, err.strip())
