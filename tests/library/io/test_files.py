"""Files are read as they were written, whatever harmless differences there are.

Files that are wrong in some way are in cli/test_wrong_input.py, hostile ones in test_bounds.py.
"""

import gzip
import json
import shutil

import numpy as np
import pycolmap
import pytest
from evo.tools import file_interface
from scipy.spatial.transform import Rotation

from alignscores.io import (
    FileError,
    TrajectoryWarning,
    read_arrays,
    read_colmap,
    read_euroc,
    read_kitti,
    read_matrices,
    read_nerf,
    read_stamps,
    read_tum,
)


def test_all_formats_hold_the_same_reference(examples):
    stamps, tum = read_tum(examples / "tum/reference.txt")
    euroc_stamps, euroc = read_euroc(examples / "euroc/data.csv")
    rows, kitti = read_kitti(examples / "kitti/reference.txt")
    names, colmap = read_colmap(examples / "colmap/reference")
    paths, nerf = read_nerf(examples / "nerf/reference.json")
    assert tum.shape == (40, 4, 4)
    for poses in (euroc, kitti, colmap, nerf):
        np.testing.assert_allclose(poses, tum, rtol=0, atol=1e-10)
    np.testing.assert_allclose(stamps, 1.7e9 + np.arange(40) / 10, rtol=0, atol=1e-6)
    np.testing.assert_allclose(euroc_stamps, stamps, rtol=0, atol=1e-6)
    np.testing.assert_array_equal(rows, np.arange(40))
    assert names[7] == "0007.png"
    assert paths[7] == "images/0007.png"


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


def test_colmap_binary_and_text_are_the_same(examples, tmp_path):
    pycolmap.Reconstruction(str(examples / "colmap/estimate")).write_text(str(tmp_path))
    binary, text = read_colmap(examples / "colmap/estimate"), read_colmap(tmp_path)
    np.testing.assert_array_equal(binary.keys, text.keys)
    np.testing.assert_allclose(binary.poses, text.poses, rtol=0, atol=1e-12)


def test_of_a_model_only_the_images_are_needed(examples, tmp_path):
    for example, name, n in (("estimate", "images.bin", 37), ("reference", "images.txt", 40)):
        (tmp_path / example).mkdir()
        shutil.copy(examples / "colmap" / example / name, tmp_path / example)
        assert len(read_colmap(tmp_path / example).keys) == n


def test_models_have_the_poses_that_pycolmap_reads(tmp_path):
    """With rigs, points and images without a pose; as text, and in memory, too."""
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig, options.num_frames_per_rig = 2, 2, 3
    model = pycolmap.synthesize_dataset(options)
    model.deregister_frame(1)
    written = {name: tmp_path / name for name in ("binary", "text")}
    for path in written.values():
        path.mkdir()
    model.write_binary(str(written["binary"]))
    model.write_text(str(written["text"]))
    theirs = {image.name: image for image in model.images.values() if image.has_pose}
    matrices = [theirs[name].cam_from_world().inverse().matrix() for name in sorted(theirs)]
    for source in (*written.values(), model):
        names, poses = read_colmap(source)
        assert names.tolist() == sorted(theirs)
        np.testing.assert_allclose(poses[:, :3], matrices, rtol=0, atol=1e-14)


@pytest.mark.parametrize(("size", "reason"), [(0, "0 of its 0"), (300, "3 of its"), (-1, "36 of")])
def test_a_binary_model_is_known_to_be_whole(examples, tmp_path, size, reason):
    content = (examples / "colmap/estimate/images.bin").read_bytes()
    (tmp_path / "images.bin").write_bytes(content[:size])
    with pytest.raises(FileError, match=f"images.bin: is cut off: it holds {reason}"):
        read_colmap(tmp_path)


def test_a_text_model_without_points_is_refused(examples, tmp_path):
    """Otherwise every second image would be taken for the points of the first."""
    lines = (examples / "colmap/reference/images.txt").read_text().splitlines()
    images = [line for line in lines if line.endswith(".png")]
    (tmp_path / "images.txt").write_text("\n".join(images))
    with pytest.raises(FileError, match=r"images.txt, line 2: expected the line of 2D points"):
        read_colmap(tmp_path)


@pytest.mark.parametrize("rows", [3, 4])
def test_nerf_camera_axes_are_turned(write, rows):
    matrix = np.eye(4)
    matrix[:3, 3] = [1, 2, 3]
    frames = [{"file_path": "./a/../b.png", "transform_matrix": matrix.tolist()[:rows]}]
    names, poses = read_nerf(write(json.dumps({"frames": frames})))
    np.testing.assert_array_equal(poses[0, :3, :3], np.diag([1.0, -1.0, -1.0]))
    np.testing.assert_array_equal(poses[0, :3, 3], [1, 2, 3])
    assert names.tolist() == ["b.png"]
    frames[0]["transform_matrix"][0][3] = float("nan")  # a camera that was not estimated
    assert np.isnan(read_nerf(write(json.dumps({"frames": frames}))).poses[0, 0, 3])
    of_nerfstudio = [{"file_path": "a", "transform": [[None] * 4] * rows}]
    assert np.isnan(read_nerf(write(json.dumps(of_nerfstudio))).poses[0, :3]).all()


@pytest.mark.parametrize(
    "content",
    [
        "# c\n0 1 2 3 0 0 0 1\n1 4 5 6 1 0 0 0\n",
        "0 1 2 3 0 0 0 1\r\n1 4 5 6 1 0 0 0\r\n",
        "0 1 2 3 0 0 0 1\r1 4 5 6 1 0 0 0",
        "\ufeff0 1 2 3 0 0 0 1\n\n  1\t4  5 6 1 0 0 0  \n\n",
        "0 1 2 3 0 0 0 1\n  # c\n1.0e0 4. +5 6 1 -0 0 0",
    ],
)
def test_harmless_differences(write, content):
    stamps, poses = read_tum(write(content))
    np.testing.assert_array_equal(stamps, [0, 1])
    np.testing.assert_array_equal(poses[:, :3, 3], [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(poses[:, :3, :3], [np.eye(3), np.diag([1, -1, -1])])


def test_a_pose_with_only_a_position_or_a_rotation_is_read(write):
    """A position without a rotation; quaternions that are not finite are none."""
    numbers = "nan 2 3 0 0 0 1", "1 2 3 nan 0 0 1", "1 2 3 inf 0 0 1", "1 2 3 1 0 0 0"
    _, poses = read_tum(write([f"{stamp} {line}" for stamp, line in enumerate(numbers)]))
    assert np.isfinite(poses[:, :3, 3]).all(axis=1).tolist() == [False, True, True, True]
    assert np.isfinite(poses[:, :3, :3]).all(axis=(1, 2)).tolist() == [True, False, False, True]


def test_quaternions_are_normalised(write, recwarn):
    rotations = Rotation.random(4, rng=0)
    lengths = 1, 1.001, 1.09, 0.91
    lines = [
        f"{i} 0 0 0 " + " ".join(map(str, length * quaternion))
        for i, (length, quaternion) in enumerate(zip(lengths, rotations.as_quat(), strict=True))
    ]
    _, poses = read_tum(write(lines[:2]))
    np.testing.assert_allclose(poses[:, :3, :3], rotations.as_matrix()[:2], atol=1e-14)
    assert not recwarn.list
    message = r"line 3: .* unit length \(off by 0.09\) and so have 1 more; normalised"
    with pytest.warns(TrajectoryWarning, match=message):
        _, poses = read_tum(write(lines))
    np.testing.assert_allclose(poses[:, :3, :3], rotations.as_matrix(), atol=1e-14)


def test_rounded_matrices_become_rotations(write):
    rng = np.random.default_rng(0)
    exact = Rotation.random(30, rng=rng).as_matrix()
    rows = np.concatenate([exact, np.zeros((30, 3, 1))], axis=2).reshape(30, 12)
    _, poses = read_kitti(write("\n".join(" ".join(f"{x:.4f}" for x in row) for row in rows)))
    gram = poses[:, :3, :3].transpose(0, 2, 1) @ poses[:, :3, :3]
    np.testing.assert_allclose(gram, np.tile(np.eye(3), (30, 1, 1)), atol=1e-14)
    np.testing.assert_allclose(poses[:, :3, :3], exact, atol=2e-4)
    with pytest.warns(TrajectoryWarning, match="line 1: has a matrix that is only roughly"):
        _, poses = read_kitti(write("1.02 0 0 0 0 1 0 0 0 0 1 0"))
    np.testing.assert_allclose(poses[0, :3, :3], np.eye(3), atol=1e-9)


def test_stamps_of_a_file(write):
    """The first column, below a header."""
    path = write("# x\n\ntime,file\n 1.5,a\n2.5,b c\n3\n")
    assert read_stamps(path).tolist() == [1.5, 2.5, 3]


def matrix(x, rows=4):
    text = [f"0 -1 0 {x}", "1 0 0 2", "0 0 1 3", "0 0 0 1"]
    return "\n".join(text[:rows]) + "\n"


def test_folders_of_matrices(tmp_path):
    """By their numbers, not their names; a pose of infinite numbers was not estimated."""
    lost = "-inf -inf -inf -inf\n" * 4
    for name, text in (("10", matrix(5, 3)), ("9", lost), ("frame-000002", matrix(4))):
        (tmp_path / f"{name}.txt").write_text(text)
    numbers, poses = read_matrices(tmp_path)
    assert numbers.tolist() == [2, 9, 10]
    assert np.isfinite(poses[:, 0, 3]).tolist() == [True, False, True]
    assert poses[[0, 2], :3, 3].tolist() == [[4, 2, 3], [5, 2, 3]]
    (tmp_path / "a.txt").write_text(matrix(6))
    assert read_matrices(tmp_path).keys.tolist() == ["10", "9", "a", "frame-000002"]
    (tmp_path / "7.pose.txt").write_text(matrix(7))  # of 7-Scenes, whose folders hold more
    assert read_matrices(tmp_path).keys.tolist() == [7]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (None, " is not a folder with matrices in .txt files"),
        ("1 2 3\n", ".*1.txt: must hold a 4 x 4 matrix, not 1 x 3"),
        (matrix(0) + "0 0 0 1\n", ".*1.txt: must hold a 4 x 4 matrix, not 5 x 4"),
        (matrix(0, 3) + "0 0 1 0\n", ".*1.txt: the last row of the matrix must be"),
        ("9 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", ", 1.txt: the matrix is not a rotation"),
    ],
)
def test_folders_without_matrices(tmp_path, text, reason):
    if text:
        (tmp_path / "1.txt").write_text(text)
    with pytest.raises(FileError, match=f"{tmp_path}.*{reason}"):
        read_matrices(tmp_path)


POSES = np.tile(np.eye(4), (3, 1, 1))


@pytest.mark.parametrize(
    ("arrays", "keys"),
    [
        *[({"p": POSES}, [0, 1, 2]), ({"p": POSES[:, :3]}, [0, 1, 2])],
        ({"p": POSES, "t": np.array([0.5, 1, 9])}, [0.5, 1, 9]),
        ({"t": np.array([5, 6, 7]), "p": POSES.astype(int)}, [5, 6, 7]),
        ({"p": POSES, "t": np.array([[0.5], [1], [9]])}, [0.5, 1, 9]),
        ({"p": POSES, "t": np.array([5, 6, 7], "M8[ms]")}, [0.005, 0.006, 0.007]),
        ({"p": POSES, "names": np.array(["a", "c", "b"]), "K": np.eye(3)}, ["a", "c", "b"]),
        ({"p": POSES, "model": np.array(["a", "a", "a"])}, [0, 1, 2]),
        ({"p": POSES, "t": np.zeros(4), "q": np.zeros((3, 4, 5)), "r": np.eye(4)}, [0, 1, 2]),
        ({"p": POSES[None], "K": np.ones((1, 3, 3, 3))}, [0, 1, 2]),  # a batch of one
        ({"p": POSES[None, :, :3], "t": np.array([[0.5, 1, 9]])}, [0.5, 1, 9]),
    ],
)
def test_arrays_of_matrices(tmp_path, arrays, keys):
    path = tmp_path / "x.npz"
    np.savez(path, **arrays)
    trajectory = read_arrays(path)
    assert trajectory.keys.tolist() == keys
    timed = "t" in arrays and arrays["t"].size == 3
    assert trajectory.keys.dtype.kind == ("f" if timed else "U" if "names" in arrays else "i")
    np.testing.assert_array_equal(trajectory.poses, POSES)
    assert trajectory.poses.dtype == float


ONE_ARRAY = r"must have one array of numbers, \(n, 4, 4\) or \(n, 3, 4\); it has "


@pytest.mark.parametrize(
    ("arrays", "reason"),
    [
        ({}, rf": {ONE_ARRAY}none"),
        ({"p": POSES + 1}, r", p\[0\]: the last row of the matrix must be 0 0 0 1"),
        ({"p": POSES[:0]}, ": has no poses"),
        ({"p": POSES, "t": np.arange(3), "u": np.arange(3)}, ": has 2 arrays of 3 numbers; leave"),
        ({"p": POSES, "t": np.arange(4)}, ": has 3 poses, but 4 numbers in order in 't'; write a"),
        ({"p": POSES, "a": np.array([*"xyz"]), "b": np.array([*"abc"])}, ": has 2 arrays of 3 tex"),
        ({"p": POSES, "t": np.array([0, np.inf, 1])}, r", p\[1\]: the time stamp is not finite"),
        ({"p": POSES, "q": POSES}, rf": {ONE_ARRAY}p \(3, 4, 4\), q \(3, 4, 4\)"),
        ({"p": np.full((3, 4, 4), "a")}, rf": {ONE_ARRAY}none"),
        ({"p": np.array([POSES, POSES])}, rf": {ONE_ARRAY}p \(2, 3, 4, 4\)"),
        ({"p": np.array([{}, {}], dtype=object)}, ": is not a file of arrays, .* without objects"),
    ],
)
def test_arrays_that_are_no_trajectory(tmp_path, arrays, reason):
    path = tmp_path / "x.npz"
    np.savez(path, **arrays)
    with pytest.raises(FileError, match=f"x.npz{reason}"):
        read_arrays(path)


@pytest.mark.parametrize("numbers", [[0.9, 0.2, 0.7], [500.0] * 3])
def test_confidences_and_focal_lengths_are_no_stamps(tmp_path, numbers):
    """As networks save them next to poses."""
    path = tmp_path / "x.npz"
    np.savez(path, p=POSES, conf=numbers)
    with pytest.warns(TrajectoryWarning, match="conf: not in order, and not read as time stamps"):
        assert read_arrays(path).keys.tolist() == [0, 1, 2]
    np.savez(path, p=POSES, conf=numbers, t=[5.0, 6.0, 7.0])
    assert read_arrays(path).keys.tolist() == [5, 6, 7]


def test_text_in_utf_16_is_said_to_be(write):
    """As PowerShell writes it."""
    with pytest.raises(FileError, match=r"est.txt: is UTF-16, as PowerShell's > writes it; save"):
        read_tum(write("0 0 0 0 0 0 0 1\n".encode("utf-16")))


def test_a_compressed_file_is_said_to_be_one(tmp_path):
    text = b"0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n"
    path = tmp_path / "est.txt.gz"
    path.write_bytes(gzip.compress(text))
    with pytest.raises(FileError, match=r"est.txt.gz: is compressed; unpack it"):
        read_tum(path)
