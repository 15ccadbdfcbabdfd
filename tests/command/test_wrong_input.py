"""Wrong input gets one line that names file, place and remedy.

A case is a spoilt example: its format; whether it is reference, estimate or frames; how its lines,
content or folder are edited; and the message.
"""

import re
import shutil

import pytest

from tests.files import FILES

NOTHING, FOLDER = object(), object()  # instead of a file


def clock(start):
    """Stamps that count seconds from a start."""

    def edit(lines):
        edited = []
        for line in lines:
            stamp, rest = re.fullmatch(r"([\d.]*)(.*)", line).groups()
            if stamp:
                seconds = float(stamp) / (1 if "." in stamp else 1e9) - start
                stamp = f"{seconds:.6f}"
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


COLMAP_LINE = "bad/images.txt, line 7: must hold 'IMAGE_ID QW"
CUT = "is cut off: it holds"

CASES = {  # "format file what": its edit, the message
    **{
        f"{format_name} {whose} in s from a start": (clock(1.7e9), message)
        for format_name in ("tum", "euroc")
        for whose, message in (
            ("reference", r"offset of -1[67].*PAS 0.8[67]. corrected\); --t_offset auto adds it"),
            ("estimate", r"offset of 1[67].*PAS 0.8[67]. corrected\); --t_offset auto adds it"),
            ("frames", r"no expected frame has a reference pose: the frames go from 0.0\d* to 3.9"),
        )
    },
    "tum estimate clock days away": (clock(1e6), "bad: no time stamps in common: the ref"),
    "tum estimate one stamp in common": (
        always("1700000000 0 0 0 0 0 0 1"),
        r"bad: only 1 of 1 poses could be matched to the reference, for 27.5% of the",
    ),
    "tum estimate no file": (always(NOTHING), r"bad: cannot be read \(No such file"),
    "tum reference a folder": (always(FOLDER), r"bad: cannot be read \(Is a directory"),
    "tum estimate empty": (always(""), "bad: has no line of numbers"),
    "tum estimate binary": (always(b"0 1 2 3 0 0 0 1\n\xff\xfe\x9c"), r"bad, line 2: is not text"),
    "tum frames nan": (line(4, "nan"), "bad, line 4: the time stamp is not finite"),
    "tum estimate too few columns": (
        line(3, "1 2 3"),
        "bad, line 3: has 3 columns, the first row 8",
    ),
    "tum estimate is kitti": (
        always("1 0 0 0 0 1 0 0 0 0 1 0"),
        "write both with",
    ),
    "kitti estimate is tum": (always("0 1 2 3 0 0 0 1"), "has time stamps, .* give tum instead"),
    "tum estimate a word": (field(5, 3, "x"), "bad, line 5: 'x' is not a number"),
    "tum estimate another header": (
        line(1, "t a b c d e f g"),
        r"bad: its header names no x, y, z \('t a b c d e f g'\); name them, as in --est_columns",
    ),
    "tum estimate one stamp for all": (
        lambda lines: [f"1700000000 {i} 2 3 0 0 0 1" for i in range(9)],
        "bad, line 2: 8 of 9 poses have the time stamp of another one, such as 17",
    ),
    "tum reference stands still": (  # rotations differ
        lambda lines: [re.sub(r"^(\S+)( \S+){3} ", r"\1 1 2 3 ", row) for row in lines[1:]],
        "error: [^ ]*bad: the reference stands still: all of its 40 poses have one position",
    ),
    "tum reference a pose far away": (
        field(5, 1, "1e300"),
        "error: [^ ]*bad: d cannot be derived: the reference's pose at 1700000000.3",
    ),
    "tum estimate keys of two robots": (  # which are equal as floating-point numbers
        lambda lines: [f"{(97 + i % 2 << 56) + i} {i} 2 3 0 0 0 1" for i in range(40)],
        "bad, line 1: the time stamps are larger than those of any clock, from 69895866216790",
    ),
    "tum estimate a second run that begins before the first one ends": (
        lambda lines: [f"{i} {i} 2 3 0 0 0 1" for i in [*range(30), *range(20, 60)]],
        "bad, line 31: 10 of 70 .* stamps jump back by 9 s here; write a file for each run",
    ),
    "kitti estimate a line less": (
        lambda lines: lines[:-1],
        r"bad: the reference has 40 poses, the estimate 39, .* or a row of nan for each frame",
    ),
    "tum estimate stamp nan": (field(4, 0, "nan"), "bad, line 4: the time stamp is not finite"),
    "kitti estimate scaled": (
        line(2, "2 0 0 0 0 2 0 0 0 0 2 0"),
        r"bad, line 2: the matrix is not a rotation: R\^T R differs from the identity by 3",
    ),
    "kitti estimate mirrored": (
        line(2, "1 0 0 0 0 1 0 0 0 0 -1 0"),
        "bad, line 2: the matrix is not a rotation: its determinant is negative",
    ),
    "nerf estimate no JSON": (always('{\n"frames": [1,\n'), "bad: is not JSON .*line 3"),
    "nerf estimate a list": (always("[1]"), r"bad, frames\[0\]: needs a file_path and a trans"),
    "nerf estimate no frames": (always("{}"), "bad: is not a transforms.json: it has no list of f"),
    "nerf estimate other images": (
        lambda lines: [re.sub(r"(\d{4})\.png", r"x\1.png", row) for row in lines],
        "bad: no image names in common: the reference has 'images/0000.png', the estimate 'i.*'"
        ", for example; name the images of both files alike$",
    ),
    "colmap estimate no folder": (always(NOTHING), "bad: is not a folder with a COLMAP model"),
    "colmap estimate empty folder": (
        always(FOLDER),
        "is not a folder with a COLMAP model, as sparse/0 is: it has no images.bin or images.txt$",
    ),
    "colmap estimate images cut off": (
        part("images.bin", 300),
        f"bad/images.bin: {CUT} 3 of its 37",
    ),
    "colmap reference a word": (image("2 abc "), COLMAP_LINE),
}


@pytest.mark.parametrize("case", CASES)
def test_one_line_names_what_is_wrong(run, examples, tmp_path, case):
    format_name, whose, _ = case.split(maxsplit=2)
    edit, message = CASES[case]
    files = dict(zip(("reference", "estimate"), FILES[format_name], strict=True))
    good, bad = examples / files.get(whose, files["estimate"]), tmp_path / "bad"
    if good.is_dir():
        shutil.copytree(good, bad)
        content = edit(bad)
    else:
        content = edit(good.read_text().splitlines())
    replace(bad, content)
    files[whose] = bad
    options = ["--frames", bad] if whose == "frames" else []
    options += ["--missing", "ignore"] if "one stamp" in case else []
    code, out, err = run(format_name, files["reference"], files["estimate"], *options)
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
