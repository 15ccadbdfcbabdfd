"""Files with random damage are refused in a sentence, or read as a strict reader reads them.

The strict reader of a format takes what its definition says and nothing else: all lines of the same
number of fields, plain numbers, no comment but the header. It refuses whatever is doubtful, by any
exception. Where it reads a damaged file and ours does, too, both must have the same keys, and the
same positions of all cameras that ours has. Ours may refuse more, such as a tenth of duplicates or
a quaternion of length 2, and may read what is documented: comments, empty fields, other layouts.
"""

import io
import json
import posixpath
import re
import resource
import struct
import time
import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.io import FORMATS, FileError, recognise

pytestmark = pytest.mark.slow

N_FILES = 300  # of each format
MAX_GROWTH = 200e6  # bytes
MAX_SECONDS = 5.0  # of processor time, for a file
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
BINARY = struct.pack("<Q", N) + b"".join(
    struct.pack("<I7dI", row + 1, *W_FIRST[row], *POSES[row, :3, 3], 1)
    + NAMES[row].encode()
    + struct.pack("<BQ2dq", 0, 1, 1.5, 2.5, -1)
    for row in range(N)
)
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
    "binary": ("images.bin", BINARY),
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


def rows_of(content, by=None, header=None):
    """Lines of fields, without the header."""
    lines = re.split("\r\n|\r|\n", content.decode("utf-8-sig"))
    if header is not None and lines.pop(0) != header:
        raise ValueError
    assert "#" not in "".join(lines)
    return [line.split(by) for line in lines if line.strip()]


def plain(fields):
    """Numbers as C writes them; Python also reads 1_000."""
    assert all(re.fullmatch(r"[-+]?[\w.+-]+", field.strip(), re.ASCII) for field in fields)
    assert "_" not in "".join(fields)
    return [float(field) for field in fields]


def same_width(rows, width):
    assert {*map(len, rows)} == {width}
    return rows


def by_name(names, positions):
    order = sorted(range(len(names)), key=names.__getitem__)
    return [names[row] for row in order], [positions[row] for row in order]


def centre(w_first, translation):
    """The camera centre of a world-to-camera pose."""
    rotation = Rotation.from_quat(w_first, scalar_first=True)
    return (-rotation.inv().apply(translation)).tolist()


def strict_tum(content):
    rows = [plain(row) for row in same_width(rows_of(content, header="# t x y z qx qy qz qw"), 8)]
    return [row[0] for row in rows], [row[1:4] for row in rows]


def strict_kitti(content):
    rows = [plain(row) for row in same_width(rows_of(content), 12)]
    return list(range(len(rows))), [row[3::4] for row in rows]


def strict_euroc(content):
    rows = same_width(rows_of(content, ",", "#t,x,y,z,qw,qx,qy,qz"), 8)
    rows = [plain(row) for row in rows]
    return [row[0] / 1e9 for row in rows], [row[1:4] for row in rows]


def strict_names(content):
    rows = same_width(rows_of(content), 13)
    return by_name([row[0] for row in rows], [plain(row[4::4]) for row in rows])


def strict_hloc(content):
    rows = same_width(rows_of(content), 8)
    poses = [plain(row[1:]) for row in rows]
    return by_name([row[0] for row in rows], [centre(pose[:4], pose[4:]) for pose in poses])


def strict_colmap(content):
    lines = content.decode().split("\n")
    images = [line.split() for line in lines[::2]]
    assert all(len(image) == 10 for image in images)
    assert all(len(plain(line.split())) == 6 for line in lines[1::2])
    poses = [plain(image[:9])[1:8] for image in images]
    return by_name([image[9] for image in images], [centre(pose[:4], pose[4:]) for pose in poses])


def strict_binary(content):
    (n,), at, names, positions = struct.unpack_from("<Q", content), 8, [], []
    for _ in range(n):
        pose = struct.unpack_from("<4x7d4x", content, at)
        end = content.index(b"\0", at + 64)
        names.append(content[at + 64 : end].decode())
        positions.append(centre(pose[:4], pose[4:]))
        at = end + 9 + 24 * struct.unpack_from("<Q", content, end + 1)[0]
    assert at == len(content)
    return by_name(names, positions)


def strict_arrays(content):
    with np.load(io.BytesIO(content)) as file:
        return file["t"].tolist(), file["p"][:, :3, 3].tolist()


def strict_nerf(content):
    frames = json.loads(content)["frames"]
    names = [posixpath.normpath(frame["file_path"]) for frame in frames]
    positions = [[float(row[3]) for row in frame["transform_matrix"][:3]] for frame in frames]
    return by_name(names, positions)


def strict_opensfm(content):
    (model,) = json.loads(content)
    positions = [
        (-Rotation.from_rotvec(shot["rotation"]).inv().apply(shot["translation"])).tolist()
        for shot in model["shots"].values()
    ]
    return by_name(list(model["shots"]), positions)


def strict_g2o(content):
    rows = same_width(rows_of(content), 9)
    assert {row[0] for row in rows} == {"VERTEX_SE3:QUAT"}
    return [int(row[1]) for row in rows], [plain(row[2:5]) for row in rows]


STRICT = {
    "tum": strict_tum,
    "kitti": strict_kitti,
    "euroc": strict_euroc,
    "names": strict_names,
    "hloc": strict_hloc,
    "colmap": strict_colmap,
    "binary": strict_binary,
    "arrays": strict_arrays,
    "nerf": strict_nerf,
    "opensfm": strict_opensfm,
    "g2o": strict_g2o,
}


def check(format_name, content, path):
    """Read a file by its format, and by the format that it is recognised to have.

    Return whether it was compared with the strict reading.
    """
    path.write_bytes(content)
    read, reasons = None, []
    by_name = FORMATS["colmap" if format_name == "binary" else format_name].read
    for reader in (lambda path: FORMATS[recognise(path)].read(path), by_name):
        try:
            read = reader(path)
            assert read.poses.shape == (len(read.keys), 4, 4)
        except FileError as error:
            read = None
            reasons.append(str(error))
    assert all("\n" not in reason and len(reason) < 600 for reason in reasons)
    try:
        keys, positions = STRICT[format_name](content)
    except Exception:  # it refuses the file in its way
        return False
    if read is None:
        return False
    estimated = np.isfinite(read.positions).all(axis=1)
    expected = np.array(positions)
    assert read.keys.tolist() == keys
    np.testing.assert_allclose(read.positions[estimated], expected[estimated], rtol=1e-12, atol=0)
    return True


@pytest.mark.parametrize("format_name", SEEDS)
def test_damaged_files_are_refused_or_read(tmp_path, format_name):
    name, content = SEEDS[format_name]
    before, compared = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert check(format_name, content, tmp_path / name)
        for seed in range(N_FILES):
            rng = np.random.default_rng(seed)
            start = time.process_time()
            compared += check(format_name, damaged(content, rng), tmp_path / name)
            assert time.process_time() - start < MAX_SECONDS
    assert compared > 0
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown * 1024 < MAX_GROWTH


@pytest.mark.parametrize("format_name", SEEDS)
def test_the_good_files_are_read(tmp_path, format_name):
    name, content = SEEDS[format_name]
    (tmp_path / name).write_bytes(content)
    read = FORMATS["colmap" if format_name == "binary" else format_name].read
    assert len(read(tmp_path / name).keys) == N
