"""Wrong input, in whatever form, gets one line that names file, place and remedy.

One table. A case is an example's file, spoilt: its format; which file it is, reference, estimate or
frames; how its lines, its content or its folder are edited; and what is said. Wrong options are in
test_main.py.
"""

import gzip
import json
import re
import shutil

import numpy as np
import pytest

FILES = {
    "tum": ("tum/reference.txt", "tum/estimate.txt"),
    "kitti": ("kitti/reference.txt", "kitti/estimate.txt"),
    "euroc": ("euroc/data.csv", "euroc/estimate.txt"),
    "colmap": ("colmap/reference", "colmap/estimate"),
    "nerf": ("nerf/reference.json", "nerf/estimate.json"),
}
NOTHING, FOLDER = object(), object()  # instead of a file


def clock(factor, start=0.0):
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


def always(content):
    return lambda lines: content


def line(number, text):
    return lambda lines: [*lines[: number - 1], text, *lines[number:]]


def field(number, column, text, separator=" "):
    def edit(lines):
        fields = lines[number - 1].split(separator)
        fields[column] = text
        return line(number, separator.join(fields))(lines)

    return edit


def frame(number, **values):
    """A frame of a transforms.json with other values; None leaves them out."""

    def edit(lines):
        content = json.loads("\n".join(lines))
        content["frames"][number] |= values
        for name in values:
            if values[name] is None:
                del content["frames"][number][name]
        return json.dumps(content)

    return edit


def without(*names):
    def edit(folder):
        for name in names:
            (folder / name).unlink()

    return edit


def part(name, content):
    """A file of a COLMAP model with another content, or with so many bytes."""

    def edit(folder):
        path = folder / name
        path.write_bytes(path.read_bytes()[:content] if isinstance(content, int) else content)

    return edit


def image(text):
    """A COLMAP model whose second image, on line 7, begins otherwise."""

    def edit(folder):
        path = folder / "images.txt"
        rows = path.read_text().splitlines()
        rows[6] = text + rows[6].split(maxsplit=2)[2]
        path.write_text("\n".join(rows))

    return edit


def inside(folder):
    """A folder that is no model, but holds one."""
    shutil.copytree(folder, folder / "0")
    for path in folder.glob("*.*"):
        path.unlink()


def parts_cut_off(folder):
    inside(folder)
    shutil.copytree(folder / "0", folder / "1")
    part("1/images.bin", 300)(folder)


SECONDS = "write them in seconds"
TUM, EST = "tum", "estimate"
NOT_FINITE = "the pose is not finite; a reference must be complete .is this the estimate"
COLMAP_LINE = "bad/images.txt, line 7: must hold 'IMAGE_ID QW"
CUT = "bad: is no readable COLMAP model, as if a file were cut off"

CASES = {
    # clocks
    **{
        f"{form} {whose} in {unit}{of}": (form, whose, clock(factor, start), message)
        for form in ("tum", "euroc")
        for whose in ("reference", "estimate", "frames")
        for unit, factor in (("milliseconds", 1e3), ("microseconds", 1e6))
        for of, start, message in (
            ("", 0, rf"bad: its time stamps seem to be in {unit} .*; {SECONDS}"),
            (" from a start", 1.7e9, rf"those of the {whose} seem to be in {unit}: {SECONDS}"),
        )
    },
    **{
        f"{form} {whose} in s from a start": (form, whose, clock(1, 1.7e9), message)
        for form in ("tum", "euroc")
        for whose, message in (
            ("reference", "the reference seem to count from its start: --t_offset auto finds"),
            ("estimate", "the estimate seem to count from its start: --t_offset auto finds the"),
            ("frames", r"no due frame has a reference pose: the frames go from 0.0\d* to 3.9"),
        )
    },
    **{
        f"tum {whose} in ns{of}": (
            "tum",
            whose,
            clock(1e9, start),
            rf"in nanoseconds .*; {SECONDS}$",
        )
        for whose in ("reference", "estimate")
        for of, start in (("", 0), (" from a start", 1.7e9))
    },
    "tum clock days away": (TUM, EST, clock(1, 1e6), "bad: no time stamps in common: the ref"),
    "tum one stamp in common": (
        *(TUM, EST, always("1700000000 0 0 0 0 0 0 1")),
        r"bad: only 1 of 1 poses could be matched to the reference, and it takes 4 \(--missing ign",
    ),
    # text
    "tum no file": (TUM, EST, always(NOTHING), r"bad: cannot be read \(No such file"),
    "tum a folder": (TUM, "reference", always(FOLDER), r"bad: cannot be read \(Is a directory"),
    "kitti no file": ("kitti", "reference", always(NOTHING), r"bad: cannot be read \(No such file"),
    "euroc no file": ("euroc", EST, always(NOTHING), r"bad: cannot be read \(No such file"),
    "nerf no file": ("nerf", EST, always(NOTHING), r"bad: cannot be read \(No such file"),
    "frames no file": (TUM, "frames", always(NOTHING), r"bad: cannot be read \(No such file"),
    "tum empty": (TUM, EST, always(""), "bad: has no poses"),
    "kitti empty": ("kitti", EST, always(""), "bad: has no poses"),
    "euroc empty": ("euroc", "reference", always(""), "bad: has no poses"),
    "tum comments alone": (TUM, "reference", always("# nothing\n\n"), "bad: has no poses"),
    "frames empty": (TUM, "frames", always(""), "bad: has no time stamps"),
    "frames no stamps": (
        TUM,
        "frames",
        line(4, "x"),
        "bad, line 4: must begin with a time stamp, n",
    ),
    "tum binary": (TUM, EST, always(b"0 1 2 3 0 0 0 1\n\xff\xfe\x9c"), r"bad, line 2: is not text"),
    "tum zero bytes": (TUM, EST, field(3, 7, "\0"), r"bad, line 3: is not text \(a zero byte\)"),
    "tum UTF-16": (TUM, EST, always("0 1 2 3\n".encode("utf-16")), "bad, line 1: is not text"),
    "tum compressed without .gz": (TUM, EST, always(gzip.compress(b"1 2")), "line 1: is not text"),
    # columns and numbers
    "tum too few columns": (
        TUM,
        EST,
        line(3, "1 2 3"),
        "bad, line 3: has 3 columns, not 'timestamp",
    ),
    "tum too many columns": (
        TUM,
        EST,
        field(3, 7, "1 9"),
        "bad, line 3: has 9 columns, not 'times",
    ),
    "tum cut off in the last line": (
        TUM,
        EST,
        line(39, "1700000003.9 1"),
        "line 39: has 2 columns",
    ),
    "tum is kitti": (
        TUM,
        EST,
        always("1 0 0 0 0 1 0 0 0 0 1 0"),
        "12 columns are the kitti format",
    ),
    "kitti is tum": ("kitti", EST, always("0 1 2 3 0 0 0 1"), "8 columns are the tum format"),
    "tum is euroc": (TUM, EST, always("1,0,0,0,0,1,0,0"), "commas are the euroc format"),
    "tum a word": (TUM, EST, field(5, 3, "x"), "bad, line 5: 'x' is not a number"),
    "tum a quote": (TUM, EST, field(5, 3, '"5'), "bad, line 5: '\"5' is not a number"),
    "tum a header": (
        TUM,
        EST,
        line(1, "t x y z a b c d"),
        "1: 't' is not a .* line begins with #$",
    ),
    "euroc a header": (
        *("euroc", "reference", lambda lines: [lines[0][1:], *lines[1:]]),
        "bad, line 1: 'timestamp' is not a number; a header line begins with #$",
    ),
    "tum one stamp for all": (
        *(TUM, EST, lambda lines: [f"1700000000 {i} 2 3 0 0 0 1" for i in range(9)]),
        "bad: only 1 of 9 poses could be matched to the reference, and it takes 4",
    ),
    "kitti of 4 x 4": (
        *("kitti", EST, lambda lines: [f"{one} 0 0 0 1" for one in lines]),
        "bad, line 1: has 16 columns, not 'r11 .*; the last row, 0 0 0 1, is left out",
    ),
    "tum decimal commas": (TUM, EST, field(5, 3, "4,6"), "bad, line 5: '4,6' is not a number"),
    "kitti a word": ("kitti", EST, field(5, 3, "x"), "bad, line 5: 'x' is not a number"),
    "kitti too few columns": (
        "kitti",
        EST,
        line(3, "1 2 3"),
        "bad, line 3: has 3 columns, not 'r11",
    ),
    "kitti a line less": (
        *("kitti", EST, lambda lines: lines[:-1]),
        r"bad: the reference has 40 poses, the estimate 39: .* \(write a row of nan for each frame",
    ),
    "euroc too few columns": (
        *("euroc", "reference", line(3, "17000000001,2,3,4,1,0,0")),
        "bad, line 3: has 7 columns, not 'timestamp tx ty tz qw",
    ),
    "euroc a word": ("euroc", "reference", field(3, 2, "x", ","), "line 3: 'x' is not a number"),
    "euroc semicolons": (
        "euroc",
        EST,
        line(2, "1;2;3;4;5;6;7;8"),
        "bad, line 2: has 1 column, not",
    ),
    # what is no pose
    "tum quaternion zero": (
        *(TUM, EST, line(4, "1700000000.2 1 2 3 0 0 0 0")),
        "bad, line 4: the quaternion is zero, which is no rotation",
    ),
    "tum stamp nan": (TUM, EST, field(4, 0, "nan"), "bad, line 4: the time stamp is not finite"),
    "euroc stamp inf": ("euroc", EST, field(4, 0, "inf"), "line 4: the time stamp is not finite"),
    "tum reference nan": (TUM, "reference", field(4, 1, "nan"), f"bad, line 4: {NOT_FINITE}"),
    "euroc reference nan": (
        *("euroc", "reference", field(4, 5, "nan", ",")),
        f"bad, line 4: {NOT_FINITE}",
    ),
    "kitti reference nan": ("kitti", "reference", field(4, 3, "nan"), f"bad, line 4: {NOT_FINITE}"),
    "nerf reference nan": (
        *("nerf", "reference", frame(3, transform_matrix=[[float("nan")] * 4] * 3)),
        rf"bad, frames\[3\] \('images/0003.png'\): {NOT_FINITE}",
    ),
    "kitti scaled": (
        *("kitti", EST, line(2, "2 0 0 0 0 2 0 0 0 0 2 0")),
        r"bad, line 2: the matrix is not a rotation: R\^T R differs from the identity by 3",
    ),
    "kitti mirrored": (
        *("kitti", EST, line(2, "1 0 0 0 0 1 0 0 0 0 -1 0")),
        "bad, line 2: the matrix is not a rotation: its determinant is negative",
    ),
    "kitti zero": (
        *("kitti", "reference", line(2, " ".join("0" * 12))),
        r"bad, line 2: the matrix is not a rotation: R\^T R differs from the identity by 1",
    ),
    "kitti huge": (
        "kitti",
        EST,
        line(2, " ".join(["1e200"] * 12)),
        r"bad, line 2: .* R\^T R differs",
    ),
    "nerf scaled": (
        *("nerf", EST, frame(1, transform_matrix=np.diag([2.0, 2, 2, 1]).tolist())),
        r"bad, frames\[1\] \('images/\d*.png'\): the matrix is not a rotation",
    ),
    # nerf
    "nerf no JSON": ("nerf", EST, always('{\n"frames": [1,\n'), "bad, line 3: is no JSON"),
    "nerf cut off": ("nerf", EST, lambda lines: lines[:9], "bad, line 9: is no JSON"),
    "nerf is tum": ("nerf", EST, always("0 1 2 3 0 0 0 1"), "bad, line 1: is no JSON"),
    "nerf a list": ("nerf", EST, always("[1]"), "bad: is no transforms.json: it has no list of fr"),
    "nerf no frames": (
        "nerf",
        EST,
        always("{}"),
        "bad: is no transforms.json: it has no list of f",
    ),
    "nerf frames empty": ("nerf", EST, always('{"frames": []}'), "bad: has no frames"),
    "nerf a frame a number": (
        "nerf",
        EST,
        always('{"frames": [3]}'),
        r"frames\[0\]: needs a file_p",
    ),
    "nerf no matrix": (
        "nerf",
        EST,
        frame(2, transform_matrix=None),
        r"frames\[2\]: needs a file_pa",
    ),
    "nerf no path": (
        "nerf",
        EST,
        frame(2, file_path=None),
        r"bad, frames\[2\]: needs a file_path and",
    ),
    "nerf ragged": (
        "nerf",
        EST,
        frame(2, transform_matrix=[[1, 2], [3]]),
        r"frames\[2\]: needs a f",
    ),
    "nerf 1 x 2": (
        "nerf",
        EST,
        frame(2, transform_matrix=[[1, 2]]),
        r"\[2\]: .* transform_matrix 4 x 4",
    ),
    "nerf path a number": (
        "nerf",
        EST,
        frame(2, file_path=7),
        r"\[2\]: file_path must be a text and",
    ),
    "nerf nested": (
        "nerf",
        EST,
        always("[" * 100_000),
        "bad: is no transforms.json: it is nested to",
    ),
    "nerf other images": (
        *("nerf", EST, lambda lines: [re.sub(r"(\d{4})\.png", r"x\1.png", one) for one in lines]),
        "bad: no image names in common: the reference has 'images/0000.png', the estimate 'i",
    ),
    # colmap
    "colmap no folder": (
        "colmap",
        EST,
        always(NOTHING),
        "bad: is no folder; a COLMAP model is a folder",
    ),
    "colmap a file": (
        "colmap",
        EST,
        always("1 2"),
        "bad: is no folder; a COLMAP model is a folder w",
    ),
    "colmap empty folder": (
        "colmap",
        EST,
        always(FOLDER),
        "bad: is no COLMAP model, with cameras, im",
    ),
    "colmap no points": (
        "colmap",
        EST,
        without("points3D.bin"),
        "lacks points3D.bin; 8 zero bytes will",
    ),
    "colmap no points, text": (
        *("colmap", "reference", without("points3D.txt")),
        "bad: the COLMAP model lacks points3D.txt; an empty file will do for it",
    ),
    "colmap no cameras": (
        "colmap",
        EST,
        without("cameras.bin"),
        "the COLMAP model lacks cameras.bin$",
    ),
    "colmap no images": (
        "colmap",
        EST,
        without("images.bin"),
        "the COLMAP model lacks images.bin$",
    ),
    "colmap images alone": (
        *("colmap", EST, without("cameras.bin", "points3D.bin")),
        "bad: the COLMAP model lacks cameras.bin and points3D.bin$",
    ),
    "colmap images cut off": ("colmap", EST, part("images.bin", 300), CUT),
    "colmap images empty": ("colmap", EST, part("images.bin", 0), CUT),
    "colmap images random": (
        *("colmap", EST, part("images.bin", np.random.default_rng(0).bytes(5000))),
        CUT,
    ),
    "colmap a part cut off": ("colmap", EST, parts_cut_off, CUT.replace("bad", "bad/1")),
    "colmap no registered image": (
        *("colmap", "reference", part("images.txt", b"# none\n")),
        "bad: (the model has no registered image|is no readable COLMAP model)",
    ),
    "colmap a word": ("colmap", "reference", image("2 abc "), COLMAP_LINE),
    "colmap nan": ("colmap", "reference", image("2 nan "), COLMAP_LINE),
    "colmap a line less": ("colmap", "reference", image(""), COLMAP_LINE),
    "colmap reference is sparse/": (
        *("colmap", "reference", inside),
        "bad: is no COLMAP model, .* but .*bad/0 is: give that one$",
    ),
}


@pytest.mark.parametrize(("form", "whose", "edit", "message"), CASES.values(), ids=CASES)
def test_one_line_names_what_is_wrong(run, examples, tmp_path, form, whose, edit, message):
    files = dict(zip(("reference", "estimate"), FILES[form], strict=True))
    good, bad = examples / files.get(whose, files["estimate"]), tmp_path / "bad"
    if good.is_dir():
        shutil.copytree(good, bad)
        content = edit(bad)
    else:
        content = edit(good.read_text().splitlines())
    replace(bad, content)
    files[whose] = bad
    frames = ("--frames", bad) if whose == "frames" else ()
    code, out, err = run(form, files["reference"], files["estimate"], *frames)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert err.startswith("alignscores: error: ")
    assert str(bad) in err or whose != "estimate"
    assert re.search(message, err.strip())


def replace(path, content):
    """Put a content where there may be a folder; None leaves it as it is."""
    if content is None:
        return
    shutil.rmtree(path, ignore_errors=True)
    if content is FOLDER:
        path.mkdir()
    elif content is not NOTHING:
        content = "\n".join(content) if isinstance(content, list) else content
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
