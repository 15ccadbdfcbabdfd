import gzip
import io
import json
import shutil
import struct
from types import SimpleNamespace

import numpy as np
import pycolmap
import pytest
from evo.tools import file_interface
from scipy.spatial.transform import Rotation

from alignscores.trajectories import extras
from alignscores.trajectories.files import (
    FileError,
    TrajectoryWarning,
    bags,
    colmap,
    inverse_poses,
    read_arrays,
    read_colmap,
    read_colmap_parts,
    read_euroc,
    read_kitti,
    read_nerf,
    read_stamps,
    read_tum,
    read_vslamlab,
    text,
)
from alignscores.trajectories.files import poses as pose_checks
from alignscores.trajectories.files.poses import orthonormalise
from alignscores.trajectories.files.stamps import in_seconds, time_unit
from alignscores.trajectories.files.text import Source

LINE = "{} 1 2 3 0 0 0 1"


def test_all_formats_hold_the_same_reference(examples):
    stamps, tum = read_tum(examples / "tum/reference.txt", complete=True)
    euroc_stamps, euroc = read_euroc(examples / "euroc/data.csv", complete=True)
    rows, kitti = read_kitti(examples / "kitti/reference.txt", complete=True)
    names, colmap = read_colmap(examples / "colmap/reference", complete=True)
    paths, nerf = read_nerf(examples / "nerf/reference.json", complete=True)
    assert tum.shape == (40, 4, 4)
    for poses in (euroc, kitti, colmap, nerf):
        np.testing.assert_allclose(poses, tum, rtol=0, atol=1e-10)
    np.testing.assert_allclose(stamps, 1.7e9 + np.arange(40) / 10, rtol=0, atol=1e-6)
    np.testing.assert_allclose(euroc_stamps, stamps, rtol=0, atol=1e-6)
    np.testing.assert_array_equal(rows, np.arange(40))
    assert names[7] == "0007.png"
    assert paths[7] == "images/0007.png"


def test_the_poses_are_those_written(examples):
    """Against the numbers of the file, by hand: centre, and where the camera's z axis points."""
    fields = (examples / "tum/reference.txt").read_text().splitlines()[6].split()
    x, y, z, w = map(float, fields[4:])
    _, poses = read_tum(examples / "tum/reference.txt")
    np.testing.assert_allclose(poses[5, :3, 3], np.array(fields[1:4], float), rtol=1e-12)
    forward = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
    np.testing.assert_allclose(poses[5, :3, 2], forward, atol=1e-10)


def test_the_numbers_are_those_that_evo_reads(examples):
    """To the last bit: evo makes each number of its text by float()."""
    for name in ("reference", "estimate"):
        path = examples / f"tum/{name}.txt"
        stamps, poses = read_tum(path)
        theirs = file_interface.read_tum_trajectory_file(path)
        np.testing.assert_array_equal(stamps, theirs.timestamps)
        np.testing.assert_array_equal(poses[:, :3, 3], theirs.positions_xyz)
    path = examples / "euroc/data.csv"
    stamps, poses = read_euroc(path)
    theirs = file_interface.read_euroc_csv_trajectory(path)
    np.testing.assert_array_equal(stamps, theirs.timestamps)
    np.testing.assert_array_equal(poses[:, :3, 3], theirs.positions_xyz)
    path = examples / "kitti/estimate.txt"
    theirs = np.array(file_interface.read_kitti_poses_file(path).poses_se3)
    np.testing.assert_array_equal(read_kitti(path).poses[:, :, 3], theirs[:, :, 3])


def test_kitti_files_may_have_all_four_rows(examples, write):
    lines = (examples / "kitti/estimate.txt").read_text().splitlines()
    lost = [line for line in lines if "nan" in line]
    assert len(lost) == 3
    four_rows = [line + (" nan" * 4 if line in lost[:1] else " 0 0 0 1.0") for line in lines]
    for read, expected in zip(
        read_kitti(write(four_rows)), read_kitti(examples / "kitti/estimate.txt"), strict=True
    ):
        np.testing.assert_array_equal(read, expected)


def test_estimates_keep_what_was_not_estimated(examples):
    for read, path in (
        (read_tum, "tum/estimate.txt"),
        (read_euroc, "euroc/estimate.txt"),  # TUM, as estimates for EuRoC are
        (read_kitti, "kitti/estimate.txt"),
    ):
        keys, poses = read(examples / path)
        lost = ~np.isfinite(poses).all(axis=(1, 2))
        assert lost.sum() == (3 if read is read_kitti else 1)
        assert len(keys) == (40 if read is read_kitti else 38)


def test_colmap_binary_and_text_are_the_same(examples, tmp_path):
    pycolmap.Reconstruction(str(examples / "colmap/estimate")).write_text(str(tmp_path))
    binary, text = read_colmap(examples / "colmap/estimate"), read_colmap(tmp_path)
    np.testing.assert_array_equal(binary.keys, text.keys)
    np.testing.assert_allclose(binary.poses, text.poses, rtol=0, atol=1e-12)


def test_models_of_a_folder_are_in_the_order_of_their_numbers(examples, tmp_path):
    for name in ("10", "9", "b"):
        shutil.copytree(examples / "colmap/reference", tmp_path / name)
    assert list(read_colmap_parts(tmp_path)) == ["9", "b", "10"]


def test_what_a_model_lacks_may_be_empty(examples, tmp_path):
    """As the message on it says; see cli/test_wrong_input.py."""
    binary, text = tmp_path / "binary", tmp_path / "text"
    for model, example, points, empty in (
        (binary, "estimate", "points3D.bin", bytes(8)),
        (text, "reference", "points3D.txt", b""),
    ):
        shutil.copytree(examples / "colmap" / example, model)
        (model / points).write_bytes(empty)
    assert len(read_colmap(binary).keys) == 37
    assert len(read_colmap(text).keys) == 40


def test_a_binary_model_is_known_to_be_whole(tmp_path):
    """With points, tracks and rigs; pycolmap may read on without end where a byte is missing."""
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig, options.num_frames_per_rig = 2, 2, 3
    pycolmap.synthesize_dataset(options).write_binary(str(tmp_path))
    assert len(read_colmap(tmp_path).keys) == 12
    for name, n in (("images", 12), ("frames", 6), ("points3D", options.num_points3D)):
        path = tmp_path / f"{name}.bin"
        content = path.read_bytes()
        path.write_bytes(content[:-1])
        with pytest.raises(FileError, match=f"{name}.bin: .* it holds {n - 1} of its {n} records"):
            read_colmap(tmp_path)
        path.write_bytes(content)


def test_an_image_without_a_name_or_points_is_whole(tmp_path):
    """64 bytes for its number, its pose and its camera, the end of its name, no points."""
    path = tmp_path / "images.bin"
    content = struct.pack("<Q", 1) + 64 * b"\1" + b"\0" + struct.pack("<Q", 0)
    path.write_bytes(content)
    colmap._check_whole(path)
    path.write_bytes(content[:-1])
    with pytest.raises(FileError, match="it holds 0 of its 1 records"):
        colmap._check_whole(path)


def test_nerf_camera_axes_are_turned(write):
    matrix = np.eye(4)
    matrix[:3, 3] = [1, 2, 3]
    frames = [{"file_path": "./a/../b.png", "transform_matrix": matrix.tolist()}]
    names, poses = read_nerf(write(json.dumps({"frames": frames})))
    np.testing.assert_array_equal(poses[0, :3, :3], np.diag([1.0, -1.0, -1.0]))
    np.testing.assert_array_equal(poses[0, :3, 3], [1, 2, 3])
    assert names.tolist() == ["b.png"]
    frames[0]["transform_matrix"][0][3] = float("nan")  # a camera that was not estimated
    assert np.isnan(read_nerf(write(json.dumps({"frames": frames}))).poses[0, 0, 3])


@pytest.mark.parametrize(
    "content",
    [
        "# c\n0 1 2 3 0 0 0 1\n1 4 5 6 0 0 0 1\n",
        "0 1 2 3 0 0 0 1\r\n1 4 5 6 0 0 0 1\r\n",
        "0 1 2 3 0 0 0 1\r1 4 5 6 0 0 0 1",
        "\ufeff0 1 2 3 0 0 0 1\n\n  1\t4  5 6 0 0 0 1  \n\n",
        "0 1 2 3 0 0 0 1\n  # c\n1 4 5 6 0 0 0 1",
        "0 1 2 3 0 0 0 1\n1.0e0 4. +5 6 0 -0 0 1",
        "0 1 2 3 0 0 0 1\n1 0_4 5 6 0 0 0 1",
    ],
    ids=[
        *("comment", "CRLF", "CR", "BOM, blank lines, tabs", "indented comment", "number forms"),
        "numbers as in Python",
    ],
)
def test_harmless_differences(write, content):
    stamps, poses = read_tum(write(content))
    np.testing.assert_array_equal(stamps, [0, 1])
    np.testing.assert_array_equal(poses[:, :3, 3], [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(poses[:, :3, :3], np.tile(np.eye(3), (2, 1, 1)))


def test_compressed_files(examples, write, tmp_path):
    content = (examples / "euroc/data.csv").read_bytes()
    path = write(gzip.compress(content), "data.csv.gz")
    for read, poses in zip(read_euroc(path), read_euroc(examples / "euroc/data.csv"), strict=True):
        np.testing.assert_array_equal(read, poses)
    for broken in (content, gzip.compress(content)[:-20], gzip.compress(content)[:40] + b"x" * 90):
        with pytest.raises(FileError, match=r"data.csv.gz: is not a complete gzip file \("):
            read_euroc(write(broken, "data.csv.gz"))
    with pytest.raises(FileError, match=r"cannot be read .No such file"):
        read_tum(tmp_path / "none.gz")


@pytest.mark.parametrize("field", range(1, 8))
def test_a_reference_must_be_complete(write, field):
    fields = ["5", "1", "2", "3", "0", "0", "0", "1"]
    fields[field] = "nan"
    path = write("# c\n" + LINE.format(4) + "\n" + " ".join(fields) + "\n")
    _, poses = read_tum(path)
    assert np.isfinite(poses[0]).all()
    # What is known of the pose stays: its position can be scored without its rotation.
    assert np.isfinite(poses[1, :3, 3]).all() == (field > 3)
    assert np.isfinite(poses[1, :3, :3]).all() == (field < 4)
    with pytest.raises(FileError, match=r"line 3: the pose is not finite; .* reference comes"):
        read_tum(path, complete=True)


def test_quaternions_are_normalised(write, recwarn):
    rotation = Rotation.from_rotvec([0.3, -0.2, 0.9])
    lines = [
        f"{i} 0 0 0 " + " ".join(map(str, length * rotation.as_quat()))
        for i, length in enumerate((1, 1.001, 3, 3))
    ]
    _, poses = read_tum(write(lines[:2]))
    np.testing.assert_allclose(poses[:, :3, :3], [rotation.as_matrix()] * 2, atol=1e-14)
    assert not recwarn.list
    message = r"line 3: .* unit length \(off by 2\) and so have 1 more; normalised"
    with pytest.warns(TrajectoryWarning, match=message):
        _, poses = read_tum(write(lines))
    np.testing.assert_allclose(poses[:, :3, :3], [rotation.as_matrix()] * 4, atol=1e-14)


def test_rounded_matrices_become_rotations(write):
    rng = np.random.default_rng(0)
    exact = Rotation.random(30, rng=rng).as_matrix()
    rows = np.concatenate([exact, np.zeros((30, 3, 1))], axis=2).reshape(30, 12)
    _, poses = read_kitti(write("\n".join(" ".join(f"{x:.4f}" for x in row) for row in rows)))
    gram = poses[:, :3, :3].transpose(0, 2, 1) @ poses[:, :3, :3]
    np.testing.assert_allclose(gram, np.tile(np.eye(3), (30, 1, 1)), atol=1e-14)
    np.testing.assert_allclose(poses[:, :3, :3], exact, atol=2e-4)
    with pytest.warns(TrajectoryWarning, match="line 1: has a matrix that is only roughly"):
        read_kitti(write("1.02 0 0 0 0 1 0 0 0 0 1 0"))


def test_orthonormalised_matrices_agree_with_the_singular_value_decomposition():
    rng = np.random.default_rng(1)
    matrices = Rotation.random(100, rng=rng).as_matrix() + rng.uniform(-0.02, 0.02, (100, 3, 3))
    u, _, vt = np.linalg.svd(matrices)
    rotations, deviation = orthonormalise(matrices)
    np.testing.assert_allclose(rotations, u @ vt, atol=1e-12)
    gram = matrices.transpose(0, 2, 1) @ matrices - np.eye(3)
    np.testing.assert_array_equal(deviation, np.abs(gram).max(axis=(1, 2)))


def test_inverse_poses():
    rng = np.random.default_rng(2)
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = Rotation.random(5, rng=rng).as_matrix(), rng.random((5, 3))
    np.testing.assert_allclose(inverse_poses(poses), np.linalg.inv(poses), atol=1e-14)


def test_euroc(write):
    content = "#time,...\n1000000000,1,2,3,1,0,0,0,9,9\n\n2000000000, 4, 5, 6, 0, 1, 0, 0, x,\n"
    stamps, poses = read_euroc(write(content))
    np.testing.assert_array_equal(stamps, [1.0, 2.0])
    np.testing.assert_array_equal(poses[1, :3, :3], np.diag([1.0, -1.0, -1.0]))
    in_seconds = read_euroc(write("1400000000.05,1,2,3,1,0,0,0\n1400000000.1,1,2,3,1,0,0,0\n"))
    np.testing.assert_allclose(in_seconds.keys, [1400000000.05, 1400000000.1], rtol=0, atol=1e-6)


IN_FILE = Source("x.txt", lambda row: f"line {row + 1}")


@pytest.mark.parametrize(
    ("deviation", "message"),
    [
        ([0.0, 1e-2, np.nan, np.inf], None),
        ([0.0, 0.0101, 1e-2], "x.txt, line 2: is odd (off by 0.01); normalised"),
        (
            [0.25, 0.5, np.nan, 1.0],
            "x.txt, line 1: is odd (off by 0.25) and so have 2 more; normalised",
        ),
    ],
)
def test_what_is_normalised_is_told_of_the_first(deviation, message, recwarn):
    pose_checks._warn_of(np.array(deviation), IN_FILE, "is odd")
    assert [str(one.message) for one in recwarn] == ([] if message is None else [message])


def test_a_lost_pose_is_one_all_the_same():
    values = np.array([[1.0, 1, 2, 3, np.nan, 0, 0, 1], [2, 4, 5, 6, 1e200, 0, 0, 1e200]])
    stamps, found = pose_checks.stamped_poses(values, IN_FILE, complete=False)
    assert stamps.tolist() == [1, 2]
    assert found[:, 3].tolist() == [[0, 0, 0, 1]] * 2
    assert found[:, :3, 3].tolist() == [[1, 2, 3], [4, 5, 6]]
    assert np.isnan(found[:, :3, :3]).all()  # a length beyond all numbers is none, either


def of_matrix(rotation, position=(0.0, 0.0, 0.0)):
    matrix = np.column_stack([rotation, position])[None]
    return pose_checks.poses_from_matrices(np.array(matrix, dtype=float), IN_FILE, complete=False)[
        0
    ]


@pytest.mark.parametrize("position", [0.0, np.nan])
def test_matrices_that_are_no_rotations_are_refused(position):
    """Whose entries of RᵀR - I exceed 0.1; that of a camera without a position as well."""
    place = [position] * 3
    for square in (1.0999, 0.9001):
        with pytest.warns(TrajectoryWarning, match=r"line 1: has a matrix .* \(off by 0.1\); norm"):
            found = of_matrix(np.diag([np.sqrt(square), 1, 1]), place)
        np.testing.assert_allclose(found[:3, :3], np.eye(3), atol=1e-9)
    for square in (1.101, 0.899, 3.0):
        off = f"{abs(square - 1):.2g}"
        with pytest.raises(FileError, match=rf"^x.txt, line 1: the .* from the identity by {off}$"):
            of_matrix(np.diag([1, np.sqrt(square), 1]), place)
    with pytest.raises(FileError, match="from the identity by inf"):
        of_matrix(1e200 * np.eye(3), place)
    with pytest.raises(FileError, match=r"determinant is negative, a reflection$"):
        of_matrix(np.diag([1, -1, 1]), place)
    assert np.isnan(of_matrix(np.full((3, 3), np.nan), place)[:3, :3]).all()


def test_a_matrix_may_deviate_just_so_much(monkeypatch):
    rounded = np.diag([1.04, 1, 1])
    deviation = float(orthonormalise(rounded[None])[1][0])
    monkeypatch.setattr(pose_checks, "MAX_DEVIATION", deviation)
    with pytest.warns(TrajectoryWarning, match="off by 0.082"):
        of_matrix(rounded)
    with pytest.raises(FileError, match="a reflection"):
        of_matrix(-rounded)
    monkeypatch.setattr(pose_checks, "MAX_DEVIATION", deviation - 1e-9)
    with pytest.raises(FileError, match=r"by 0\.082$"):
        of_matrix(-rounded)


def test_rotations_take_four_steps():
    """As by hand, of a number for a matrix."""
    number = 0.5
    for _ in range(4):
        number -= number * (number**2 - 1) / 2
    rotations, deviation = orthonormalise(0.5 * np.eye(3)[None])
    np.testing.assert_allclose(rotations, number * np.eye(3)[None], rtol=1e-14)
    assert deviation.tolist() == [0.75]


@pytest.mark.parametrize(
    ("stamps", "unit"),
    [
        *[([0.0], "seconds"), ([-9.9e10], "seconds"), ([1e11], "milliseconds")],
        *[([9.9e13], "milliseconds"), ([-1e14], "microseconds"), ([9.9e16], "microseconds")],
        *[([1e17], "nanoseconds"), ([1e30], "nanoseconds")],
        # The median counts; since a start, steps do.
        *[([1.0, 2, 3, 1e30], "seconds"), ([1.0, 1e17, 1e17], "nanoseconds")],
        *[([0, 5e5, 1e6], "nanoseconds"), ([0, 4.9e5, 9e5, 9e6], "seconds")],
        *[([0.0, 5e5, 1e6, 1e6, 1e6], "nanoseconds"), ([1e14, 2e14, 2e14], "microseconds")],
        *[([5e13, 1e14, 2e14], "microseconds"), ([5e13, 9.9e13, 2e14], "nanoseconds")],
    ],
)
def test_the_unit_of_stamps(stamps, unit):
    assert time_unit(np.array(stamps)) == unit


def test_stamps_in_seconds():
    stamps = np.array([5e17, 6e17])
    found = in_seconds("x", stamps, "seconds", "nanoseconds")
    assert found.tolist() == [5e8, 6e8]
    with pytest.raises(FileError) as caught:
        in_seconds("x", stamps, "seconds", "milliseconds")
    assert str(caught.value) == (
        "x: its time stamps seem to be in nanoseconds (the first is 500000000000000000); write "
        "them in seconds or milliseconds"
    )


def test_stamps_of_a_file(write):
    assert read_stamps(write("# x\n\n,,\ntime,file\n 1.5,a\n2.5 b c\n,\n3\n")).tolist() == [
        1.5,
        2.5,
        3,
    ]
    for content, place, field in (
        ("time\nfile\n1\n", 2, "file"),
        ("1\nnan\n", 2, "nan"),
        (f"x\n1\n{'y' * 50}\n", 3, "y" * 40),
    ):
        path = write(content)
        with pytest.raises(FileError) as caught:
            read_stamps(path)
        said = f"{path}, line {place}: must begin with a time stamp, not {field!r}"
        assert str(caught.value) == said
    with pytest.raises(FileError, match=r"has no time stamps$"):
        read_stamps(write("inf\n"))


@pytest.mark.parametrize(
    ("content", "place", "reason"),
    [
        (b"a\n\xff", "line 2", "is not text (UTF-8)"),
        (b"\n\xff\n\n", "line 2", "is not text (UTF-8)"),
        (b"\n\0\n\n", "line 2", "is not text (a zero byte)"),
        (b"\0", "line 1", "is not text (a zero byte)"),
    ],
)
def test_what_is_no_text(content, place, reason):
    with pytest.raises(FileError) as caught:
        text._decoded("x", content)
    assert str(caught.value) == f"x, {place}: {reason}"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("1 2 3\n", "has 3 columns, not 'a b'"),
        ("1\n", "has 1 column, not 'a b'"),
        ("1 2 3 4 5 6 7 8", "has 8 columns, not 'a b'; 8 columns are the tum format"),
        (" ".join("1" * 12), "has 12 columns, not 'a b'; 12 columns are the kitti format"),
        (" ".join("1" * 16), "has 16 columns, not 'a b'; 16 columns are the kitti format"),
        ("1,2\n", "has 1 column, not 'a b'; files with commas are the euroc format"),
        ("x 2\n", "'x' is not a number; a header line begins with #"),
        (f"1 {'y' * 50}\n", f"'{'y' * 40}' is not a number; a header line begins with #"),
        ("1 2\n3 x\n", "'x' is not a number"),
        ("1 2\n1 2 3 4\n", "has 4 columns, the first line 2"),
    ],
)
def test_what_is_wrong_with_numbers(content, reason):
    lines = enumerate(content.splitlines(), 7)
    with pytest.raises(FileError) as caught:
        text.read_numbers("x", lines, "a b", [2, 4])
    row = 8 if content.count("\n") > 1 else 7
    assert str(caught.value) == f"x, line {row}: {reason}"


def test_numbers_of_lines():
    lines = iter([(3, "1 2"), (5, "3 nan"), (6, "5e0 1_0")])
    values, source = text.read_numbers("x", lines, "a b", [2, 4])
    np.testing.assert_array_equal(values, [[1, 2], [3, np.nan], [5, 10]])
    assert [source.place(row) for row in range(3)] == ["line 3", "line 5", "line 6"]
    with pytest.raises(FileError, match=r"^x: has no poses$"):
        text.read_numbers("x", iter([]), "a b", [2])


def test_plain_numbers_are_not_looked_at_one_by_one(monkeypatch):
    """Which takes twice as long."""
    monkeypatch.delattr(text, "is_number")
    for delimiter in (None, ","):
        lines = [(k, (delimiter or " ").join("12")) for k in range(3)]
        values, _ = text.read_numbers("x", iter(lines), "a b", [2], delimiter)
        assert values.tolist() == [[1, 2]] * 3


@pytest.mark.parametrize(("n", "fits"), [(10_000, True), (10_001, False)])
def test_the_longest_line(n, fits):
    line = "1 2".ljust(n)
    if fits:
        assert text.read_numbers("x", iter([(1, line)]), "a b", [2])[0].tolist() == [[1, 2]]
    else:
        with pytest.raises(FileError, match=r"^x, line 1: has more than 10000 characters$"):
            text.read_numbers("x", iter([(1, line)]), "a b", [2])


def test_a_stream_is_read_up_to_the_bound_and_a_byte(monkeypatch):
    for size in (4, 5):
        monkeypatch.setattr(text, "BYTES", size)
        for n in (0, 3, 4, 9, 10, 11, 12, 99):
            stream = io.BytesIO(b"x" * n)
            assert text._read_at_most(stream, 10) == b"x" * min(n, 11)
            assert stream.tell() == min(n, 11)


def test_the_bound_of_files(monkeypatch):
    monkeypatch.delenv("ALIGNSCORES_MAX_MB", raising=False)
    assert text.most_bytes() == 256_000_000
    monkeypatch.setenv("ALIGNSCORES_MAX_MB", "")
    assert text.most_bytes() == 256_000_000
    monkeypatch.setenv("ALIGNSCORES_MAX_MB", "0.5")
    assert text.most_bytes() == 500_000
    monkeypatch.setenv("ALIGNSCORES_MAX_MB", "1e308")
    assert text.most_bytes() == 2**62
    monkeypatch.setenv("ALIGNSCORES_MAX_MB", "z" * 50)
    with pytest.raises(ValueError, match=rf"above 0, not '{'z' * 40}'$"):
        text.most_bytes()
    with pytest.raises(FileError) as caught:
        text.refuse_more("x", 11, 10)
    assert str(caught.value) == (
        "x: has more than 10 bytes; set ALIGNSCORES_MAX_MB higher to read it"
    )
    text.refuse_more("x", 10, 10)


def test_of_frames_with_one_name_the_first_stays_first(write):
    matrix = np.eye(4).tolist()
    frames = []
    for k in range(60):
        row = [[*matrix[0][:3], float(k)], *matrix[1:]]
        frames.append({"file_path": f"{(7 * k) % 3}.png", "transform_matrix": row})
    names, found = read_nerf(write(json.dumps({"frames": frames})))
    expected = sorted(range(60), key=lambda k: (7 * k) % 3)
    assert found[:, 0, 3].tolist() == expected
    assert names.tolist() == [f"{(7 * k) % 3}.png" for k in expected]


def test_lines_of_images_are_followed_by_lines_of_points(write):
    lines = [
        "# a",
        "",
        "1 2 3",
        "4 5 6 7",
        "",
        "2 0 0 0 0 0 0 0 9 a name.png",
        "",
        "# b",
        "3 x",
        "0",
    ]
    found = [(number, fields) for number, fields in colmap._images_in_text(write(lines))]
    second = [*["2", "0", "0", "0", "0", "0", "0", "0", "9"], "a name.png"]
    assert found == [(3, ["1", "2", "3"]), (6, second), (9, ["3", "x"])]
    assert [number for number, _ in colmap._images_in_text(write("1\n0\n2\n0\n"))] == [1, 3]


def test_names_of_a_text_model_are_read_up_to_the_end_of_the_line(tmp_path):
    assert colmap._names_in_text(tmp_path) == {}
    (tmp_path / "images.txt").write_text("# x\n7 1 0 0 0 0 0 0 1 a b.png\n\n")
    assert colmap._names_in_text(tmp_path) == {7: "a b.png"}
    (tmp_path / "images.bin").touch()
    assert colmap._names_in_text(tmp_path) == {}


class Model:
    """A stand-in for a model in memory."""

    __module__ = "pycolmap.core"

    def __init__(self, *matrices):
        self.images = {
            k: SimpleNamespace(
                name=f"{9 - k}.png",
                has_pose=matrix is not None,
                cam_from_world=lambda matrix=matrix: SimpleNamespace(matrix=lambda: matrix),
            )
            for k, matrix in enumerate(matrices)
        }


def test_a_model_in_memory():
    assert colmap.is_model(pycolmap.Reconstruction())
    assert colmap.is_model(Model())
    assert not colmap.is_model("pycolmap")
    matrix = np.eye(4)[:3]
    matrix[:, 3] = [1, 2, 3]
    lost = np.full((3, 4), np.nan)
    names, found = read_colmap(Model(matrix, None, lost))
    assert names.tolist() == ["7.png", "9.png"]
    assert np.isnan(found[0, :3]).all()
    assert found[1, :3, 3].tolist() == [-1, -2, -3]
    with pytest.raises(FileError, match=r"^the Reconstruction, image '7.png': the pose is not fin"):
        read_colmap(Model(matrix, None, lost), complete=True)
    with pytest.raises(FileError, match=r"^the Reconstruction: the model has no registered image$"):
        read_colmap(Model(None))


def test_why_a_model_is_not_readable(monkeypatch, tmp_path):
    """The first line of the reason, without where in the program it arose."""
    for part in ("cameras", "images", "points3D"):
        (tmp_path / f"{part}.txt").touch()

    def fail(_):
        raise ValueError("[x.cc:12] Check failed: no such camera\nmore")

    monkeypatch.setattr(colmap, "require", lambda *_: SimpleNamespace(Reconstruction=fail))
    with pytest.raises(FileError) as caught:
        read_colmap(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path}: is not a readable COLMAP model, as if a file were cut off (no such camera)"
    )


def bag_of(n, topics=("/a",)):
    """A stand-in for evo with a bag of n messages."""

    class Reader:
        def __init__(self, folder):
            assert folder.suffix == ".bag"
            kinds = {"/a": "pose", "/b": "pose", "/c": "image"}
            self.connections = [
                SimpleNamespace(topic=topic, msgtype=kinds[topic]) for topic in topics
            ]

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

    def read(_, topic):
        assert topic == "/a"
        return SimpleNamespace(
            num_poses=n,
            timestamps=np.arange(n) + 0.5,
            positions_xyz=np.arange(3.0 * n).reshape(n, 3),
            orientations_quat_wxyz=np.eye(4)[[1, 0][:n]],
        )

    return SimpleNamespace(
        Rosbag1Reader=Reader, read_bag_trajectory=read, SUPPORTED_ROS_MSGS={"pose"}
    )


def lost_at(row):
    read = bag_of(row + 1).read_bag_trajectory(None, "/a")
    read.positions_xyz[row] = np.nan
    return read


def test_poses_of_a_bag(monkeypatch, tmp_path):
    path = tmp_path / "x.bag"
    with pytest.raises(FileError, match=r"x.bag: cannot be read \(No such file or directory\)$"):
        bags.read_bag(path)
    path.touch()
    for n, topic, topics in ((1, "/a", ()), (2, None, ("/a", "/c", "/a"))):
        monkeypatch.setattr(bags, "require", lambda *_, of=(n, topics): bag_of(*of))
        stamps, found = bags.read_bag(path, topic=topic)
        assert stamps.tolist() == [0.5, 1.5][:n]
        assert found[:, :3, 3].tolist() == [[0, 1, 2], [3, 4, 5]][:n]
        turns = [np.diag([1.0, -1, -1]), np.eye(3)]
        assert found[:, :3, :3].tolist() == [turn.tolist() for turn in turns[:n]]
    broken = bag_of(2)
    broken.read_bag_trajectory = lambda *_: lost_at(1)
    monkeypatch.setattr(bags, "require", lambda *_: broken)
    assert np.isnan(bags.read_bag(path, topic="/a").poses[1, 0, 3])
    with pytest.raises(FileError, match=r"x.bag, message 2: the pose is not finite"):
        bags.read_bag(path, topic="/a", complete=True)
    monkeypatch.setattr(bags, "require", lambda *_: bag_of(0))
    with pytest.raises(FileError, match=r"x.bag: has no poses on /a$"):
        bags.read_bag(path, topic="/a")
    for topics, has in (((), "has no topic with poses"), (("/b", "/a", "/c"), "has /a, /b")):
        monkeypatch.setattr(bags, "require", lambda *_, topics=topics: bag_of(1, topics))
        with pytest.raises(FileError, match=f"x.bag: {has}; --ref_topic and --est_topic name one$"):
            bags.read_bag(path)


def test_why_a_bag_is_not_readable():
    assert bags._reason(ValueError(" two\n lines ")) == "two lines"
    assert bags._reason(KeyError()) == "KeyError"


def test_a_package_that_is_missing_is_named():
    with pytest.raises(ModuleNotFoundError) as caught:
        extras.require("no_such_package.part", "evo")
    assert caught.value.name == "no_such_package"
    assert str(caught.value) == ('no_such_package is not installed: pip install "alignscores[evo]"')
    with pytest.raises(ModuleNotFoundError, match=r"json\.no_such_part"):
        extras.require("json.no_such_part", "evo")
    assert extras.require("json.decoder", "evo") is json.decoder


def test_vslamlab_needs_its_header(write):
    header = "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw"
    stamps, found = read_vslamlab(write(["# x", header, "500000000,1,2,3,1,0,0,0"]))
    assert stamps.tolist() == [0.5]
    assert found[0, :3, 3].tolist() == [1, 2, 3]
    assert found[0, :3, :3].tolist() == np.diag([1, -1, -1]).tolist()
    lost = read_vslamlab(write([header, "5,1,2,3,nan,nan,nan,nan"])).poses
    assert np.isnan(lost[0, :3, :3]).all()
    with pytest.raises(FileError, match="line 2: has 1 column, not 'ts"):
        read_vslamlab(write([header, "5 1 2 3 0 0 0 1"]))
    for content in ("", "500000000,1,2,3,1,0,0,0\n"):
        with pytest.raises(
            FileError, match=r"must begin with 'ts \(ns\),.*', as files of VSLAM-LAB"
        ):
            read_vslamlab(write(content))


def test_a_file_read_once_has_the_same_content_until_then(tmp_path):
    path = tmp_path / "x.txt"

    def read(content):
        path.write_bytes(content)
        return text.read_bytes(path)

    with text.reading_once():
        assert read(b"one") == b"one"
        with text.reading_once():
            assert read(b"two") == b"one"
        assert read(b"three") == b"one"
    assert read(b"four") == b"four"
    assert read(b"five") == b"five"


def test_what_is_no_text_or_comment_in_a_line_is_told(write):
    with pytest.raises(FileError, match=r"line 2: is not text \(UTF-8\)$"):
        read_tum(write(b"\n\xff"))
    with pytest.raises(FileError, match="line 1: has 10 columns, not"):
        read_tum(write("0 1 2 3 0 0 0 1 # x\n"))


MATRIX = np.eye(4).tolist()


@pytest.mark.parametrize(
    ("content", "place", "reason"),
    [
        ('{"frames": [\n1, }', "line 2", "is not JSON (Expecting value)"),
        *[
            (json.dumps([frame]), "frames[0]", reason)
            for frame, reason in (
                ({"transform": MATRIX}, "needs a file_path and a transform_matrix of numbers"),
                ({"file_path": "a"}, "needs a file_path and a transform_matrix of numbers"),
                (
                    {"file_path": 3, "transform": MATRIX},
                    "file_path must be a text and transform_matrix 4 x 4",
                ),
                (
                    {"file_path": "a", "transform": MATRIX[:2]},
                    "file_path must be a text and transform_matrix 4 x 4",
                ),
            )
        ],
    ],
)
def test_what_is_no_transforms_json(write, content, place, reason):
    path = write(content)
    with pytest.raises(FileError) as caught:
        read_nerf(path)
    assert str(caught.value) == f"{path}, {place}: {reason}"


def test_a_matrix_of_null_is_a_camera_that_was_not_estimated(write):
    frames = [{"file_path": "a", "transform": [[None] * 4] * 4}]
    assert np.isnan(read_nerf(write(json.dumps(frames))).poses[0, :3]).all()


@pytest.mark.parametrize("rows", [3, 4])
def test_frames_may_have_three_rows_or_four(write, rows):
    frames = [{"file_path": "a", "transform": MATRIX[:rows]}]
    names, found = read_nerf(write(json.dumps(frames)))
    assert names.tolist() == ["a"]
    assert found[0].tolist() == np.diag([1, -1, -1, 1]).tolist()


@pytest.mark.parametrize(
    ("row", "complete", "reason"),
    [
        ([np.inf, 1, 2, 3, 0, 0, 0, 1], False, "the time stamp is not finite"),
        (
            [1, 1, 2, 3, 0, 0, 0, 0],
            False,
            "the quaternion is zero, which is not a rotation",
        ),
        (
            [1, 1, 2, np.nan, 0, 0, 0, 1],
            True,
            "the pose is not finite; a reference must be complete (is this the estimate? The "
            "reference comes first)",
        ),
    ],
)
def test_stamped_poses_that_are_refused(row, complete, reason):
    values = np.array([[0.0, 0, 0, 0, 0, 0, 0, 1], row, row])
    with pytest.raises(FileError) as caught:
        pose_checks.stamped_poses(values, IN_FILE, complete=complete)
    assert str(caught.value) == f"x.txt, line 2: {reason}"


def test_matrices_of_a_reference_are_complete():
    matrices = np.tile(np.eye(4)[:3], (3, 1, 1))
    matrices[1, 0, 3] = np.nan
    with pytest.raises(FileError, match=r"^x.txt, line 2: the pose is not finite; a reference"):
        pose_checks.poses_from_matrices(matrices, IN_FILE, complete=True)


POSES = np.tile(np.eye(4), (3, 1, 1))


@pytest.mark.parametrize(
    ("arrays", "keys"),
    [
        *[({"p": POSES}, [0, 1, 2]), ({"p": POSES[:, :3]}, [0, 1, 2])],
        ({"p": POSES, "t": np.array([0.5, 1, 9])}, [0.5, 1, 9]),
        ({"t": np.array([5, 6, 7]), "p": POSES.astype(int)}, [5, 6, 7]),
        ({"p": POSES, "names": np.array(["a", "b", "c"]), "K": np.eye(3)}, [0, 1, 2]),
        ({"p": POSES, "t": np.zeros(4), "q": np.zeros((3, 4, 5)), "r": np.eye(4)}, [0, 1, 2]),
    ],
)
def test_arrays_of_matrices(tmp_path, arrays, keys):
    path = tmp_path / "x.npz"
    np.savez(path, **arrays)
    found = read_arrays(path)
    assert found.keys.tolist() == keys
    assert found.keys.dtype.kind == ("f" if "t" in arrays and len(arrays["t"]) == 3 else "i")
    np.testing.assert_array_equal(found.poses, POSES)
    assert found.poses.dtype == float


def test_an_array_alone(tmp_path):
    lost = POSES.copy()
    lost[1] = np.nan
    np.save(tmp_path / "x.npy", lost)
    rows, found = read_arrays(tmp_path / "x.npy")
    assert rows.tolist() == [0, 1, 2]
    assert np.isnan(found[1, :3]).all()
    np.testing.assert_array_equal(found[::2], POSES[::2])
    with pytest.raises(FileError, match=r"x.npy, the array\[1\]: the pose is not finite; a ref"):
        read_arrays(tmp_path / "x.npy", complete=True)


def with_last_row(*values):
    poses = POSES.copy()
    poses[2, 3] = values
    return poses


ONE_ARRAY = "must have one array of numbers, (n, 4, 4) or (n, 3, 4); it has "


@pytest.mark.parametrize(
    ("arrays", "reason"),
    [
        *[
            ({"p": with_last_row(*row)}, ", p[2]: the last row must be 0 0 0 1")
            for row in ([0, 0, 0, 2], [1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1], [0, 0, 0, 0])
        ],
        ({"p": POSES[:0]}, ": has no poses"),
        (
            {"p": POSES, "t": np.zeros(3), "u": np.ones(3)},
            ": has 2 arrays of 3 numbers; leave the stamps",
        ),
        ({"p": POSES, "t": np.array([0, np.inf, 1])}, ", p[1]: the time stamp is not finite"),
        ({"p": POSES, "q": POSES}, f": {ONE_ARRAY}p (3, 4, 4), q (3, 4, 4)"),
        ({"x" * 50: np.zeros((3, 4, 5))}, f": {ONE_ARRAY}{'x' * 40} (3, 4, 5)"),
        ({"p": np.full((3, 4, 4), "a")}, f": {ONE_ARRAY}p (3, 4, 4)"),
        ({"p": np.eye(4)}, f": {ONE_ARRAY}p (4, 4)"),
        ({"p": POSES[None]}, f": {ONE_ARRAY}p (1, 3, 4, 4)"),
        (
            {"p": np.array([{}, {}], dtype=object)},
            ": is not a file of arrays, .npy or .npz, without objects",
        ),
    ],
)
def test_arrays_that_are_no_trajectory(tmp_path, arrays, reason):
    path = tmp_path / "x.npz"
    np.savez(path, **arrays)
    with pytest.raises(FileError) as caught:
        read_arrays(path)
    assert str(caught.value) == f"{path}{reason}"
