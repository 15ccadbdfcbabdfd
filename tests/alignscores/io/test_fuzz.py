"""Files with random damage are refused in a sentence, or read as a strict reader reads them."""

import io
import json
import re
import resource
import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.io import FORMATS, FileError, recognise

pytestmark = pytest.mark.slow

N_FILES = 300  # of each format
MAX_GROWTH = 200e6  # bytes
RNG = np.random.default_rng(0)
N = 30
POSES = np.tile(np.eye(4), (N, 1, 1))
POSES[:, :3, 3] = RNG.normal(size=(N, 3))
POSES[:, :3, :3] = Rotation.random(N, rng=0).as_matrix()
QUATERNIONS = Rotation.from_matrix(POSES[:, :3, :3]).as_quat()
STAMPS = 1.7e9 + np.arange(N) / 10
W_FIRST = QUATERNIONS[:, [3, 0, 1, 2]]


def table(*columns, by=" ", header="", names=()):
    values = np.column_stack(columns)
    rows = [by.join(f"{x:.9g}" if abs(x) < 1e9 else f"{x:.3f}" for x in row) for row in values]
    rows = [f"{name} {row}" for name, row in zip(names, rows, strict=True)] if names else rows
    return "\n".join([*([header] if header else []), *rows, ""]).encode()


def arrays(save, **named):
    file = io.BytesIO()
    save(file, **named)
    return file.getvalue()


NAMES = [f"{row:03}.png" for row in range(N)]
MATRICES = POSES[:, :3].reshape(N, 12)
IMAGES = b"\n".join(
    b"%d %s 1 %s\n1.5 2.5 -1 3 4 7" % (row, line, NAMES[row].encode())
    for row, line in enumerate(table(W_FIRST, POSES[:, :3, 3]).splitlines())
)
SHOTS = {
    name: {"rotation": [0.1, 0.2, 0.3], "translation": list(pose[:3, 3])}
    for name, pose in zip(NAMES, POSES, strict=True)
}
FRAMES = [
    {"file_path": name, "transform_matrix": pose.tolist()}
    for name, pose in zip(NAMES, POSES, strict=True)
]
SEEDS = {  # a good file of each format, and its name
    "tum": ("a.txt", table(STAMPS, POSES[:, :3, 3], QUATERNIONS, header="# t x y z qx qy qz qw")),
    "kitti": ("a.txt", table(MATRICES)),
    "euroc": (
        "a.csv",
        table(STAMPS * 1e9, POSES[:, :3, 3], W_FIRST, by=",", header="#t,x,y,z,qw,qx,qy,qz"),
    ),
    "names": ("a.txt", table(MATRICES, names=NAMES)),
    "hloc": ("a.txt", table(W_FIRST, POSES[:, :3, 3], names=NAMES)),
    "colmap": ("images.txt", IMAGES),
    "arrays": ("a.npz", arrays(np.savez_compressed, p=POSES, t=STAMPS)),
    "nerf": ("a.json", json.dumps({"frames": FRAMES}).encode()),
    "opensfm": ("a.json", json.dumps([{"shots": SHOTS}]).encode()),
    "g2o": (
        "a.g2o",
        table(POSES[:, :3, 3], QUATERNIONS, names=[f"VERTEX_SE3:QUAT {n}" for n in range(N)]),
    ),
}
PIECES = (
    b"nan",
    b"-1.#IND",
    b"1e999",
    b"1e-999",
    b",",
    b";",
    b"#",
    b'"',
    b"\0",
    b"\xff",
    b"\n",
    b" ",
)
PIECES += b" ", b"[", b"{", b"}", b"-", b"e", b"_", b"\t", b"\r", b"9" * 400, b"0 0 0 0", b"t x y z"


def damaged(content, rng):
    """The content with some bytes changed, left out, repeated, or replaced by a piece."""
    content = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        at, length = rng.integers(len(content) or 1), int(rng.integers(1, 60))
        piece = PIECES[rng.integers(len(PIECES))]
        match rng.integers(6):
            case 0:
                content[at : at + 1] = bytes([rng.integers(256)])
            case 1:
                del content[at : at + length]
            case 2:
                content[at:at] = content[at : at + length]
            case 3:
                content[at:at] = piece
            case 4:
                content[at : at + length] = piece
            case 5:
                del content[at:]
    return bytes(content)


def strict(content):
    """Stamps and positions of a table of TUM by another way; None where rows are of other width.

    What is read must be numbers.
    """
    lines = re.split("[\r\n]", content.decode("utf-8-sig"))
    rows = [line.split() for line in lines if line.strip() and not line.startswith("#")]
    if {*map(len, rows)} != {8}:
        return None
    return np.array([list(map(float, row[:4])) for row in rows])


def check(form, content, path):
    """Read a file by its format, and by the format that it is recognised to have."""
    path.write_bytes(content)
    read, reasons = None, []
    for reader in (FORMATS[form].read, lambda path: FORMATS[recognise(path)].read(path)):
        try:
            read = reader(path)
            assert read.poses.shape == (len(read.keys), 4, 4)
        except FileError as error:
            reasons.append(str(error))
    assert all("\n" not in reason and len(reason) < 600 for reason in reasons)
    if form == "tum" and read is not None and b"#" not in content[3:]:
        expected = strict(content)
        if expected is not None:
            known = np.isfinite(read.positions).all(axis=1)
            np.testing.assert_array_equal(read.keys, expected[:, 0])
            np.testing.assert_array_equal(read.positions[known], expected[known, 1:])


@pytest.mark.parametrize("form", SEEDS)
def test_damaged_files_are_refused_or_read(tmp_path, form):
    name, content = SEEDS[form]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check(form, content, tmp_path / name)
        for seed in range(N_FILES):
            rng = np.random.default_rng(seed)
            check(form, damaged(content, rng), tmp_path / name)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown * 1024 < MAX_GROWTH


@pytest.mark.parametrize("form", SEEDS)
def test_the_good_files_are_read(tmp_path, form):
    name, content = SEEDS[form]
    (tmp_path / name).write_bytes(content)
    assert len(FORMATS[form].read(tmp_path / name).keys) == N
