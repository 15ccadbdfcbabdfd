"""Files that look like another format, or are damaged so that they do."""

import json
import re
import shutil

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import evaluate
from alignscores.io import (
    FileError,
    read_arrays,
    read_colmap,
    read_g2o,
    read_hloc,
    read_kitti,
    read_matrices,
    read_names,
    read_nerf,
    read_opensfm,
    read_rig_frames,
    read_tum,
    recognise,
)

N = 40
RNG = np.random.default_rng(0)
STAMPS = np.arange(N) / 10
POSITIONS = np.cumsum(RNG.normal(size=(N, 3)), axis=0).round(6)
ROTATIONS = Rotation.random(N, rng=1)
QUATERNIONS = ROTATIONS.as_quat()
W_FIRST = QUATERNIONS[:, [3, 0, 1, 2]]
MATRICES = np.concatenate([ROTATIONS.as_matrix(), POSITIONS[:, :, None]], axis=2)
MATRICES[0, :, :3] = np.eye(3)
NAMES = [f"{row:04}.png" for row in range(N)]
IMAGE_HEADER = "IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME"


def rows(*columns, by=" "):
    """Return a line of text for each row; whole numbers are written as such."""
    parts = [column if np.ndim(column) == 2 else np.array(column)[:, None] for column in columns]
    lines = zip(*(part.tolist() for part in parts), strict=True)
    return [
        by.join(f"{x:.12g}" if isinstance(x, float) else str(x) for part in line for x in part)
        for line in lines
    ]


def lines(*texts):
    return "\n".join([*texts, ""])


WHOLE = np.arange(N)
ON_SPHERE = Rotation.from_rotvec(WHOLE[:, None] * [[0, 0, 0.05]]).apply([1, 0, 0])
LOOKALIKES = {  # tables whose first row, or more, has the numbers of an image
    "whole stamps and two columns": (
        read_tum,
        lines(
            "# t x y z qx qy qz qw n_points status",
            *rows(WHOLE, POSITIONS, QUATERNIONS, WHOLE, NAMES),
        ),
    ),
    "matrices with comments": (
        read_kitti,
        lines(*(f"{row} # {n}" for n, row in enumerate(rows(MATRICES.reshape(N, 12))))),
    ),
    "a comment in the first row": (
        read_kitti,
        lines(rows(MATRICES.reshape(N, 12))[0] + " # world", *rows(MATRICES.reshape(N, 12))[1:]),
    ),
    "a number that Microsoft lost": (
        read_tum,
        lines(
            rows(WHOLE, MATRICES.reshape(N, 12)[:, :11])[0] + " -1.#IND",
            *rows(WHOLE, MATRICES.reshape(N, 12))[1:],
        ),
    ),
    "a sphere": (
        read_tum,
        lines("# t x y z qx qy qz qw n name", *rows(WHOLE, ON_SPHERE, QUATERNIONS, WHOLE, NAMES)),
    ),
}


@pytest.mark.filterwarnings("ignore::alignscores.io.TrajectoryWarning")
@pytest.mark.parametrize("kind", LOOKALIKES)
def test_tables_are_no_images_of_a_model(write, kind):
    read, text = LOOKALIKES[kind]
    path = write(text)
    assert recognise(path) in ("tum", "kitti")
    positions = read(path).positions
    expected = ON_SPHERE if kind == "a sphere" else POSITIONS
    np.testing.assert_allclose(positions[1:], expected[1:], atol=1e-8)


def test_the_first_rows_tell_a_table_from_matrices(write):
    """Columns that were never filled are no proof of a matrix, nor is a lost first row."""
    lost = np.full((N, 3), np.nan)
    text = lines(*rows(STAMPS, POSITIONS, QUATERNIONS, lost, np.ones(N)))
    with pytest.warns(match="read t x y z qx qy qz qw, 4 of 12 columns ignored"):
        stamps, poses = read_tum(write(text))
    np.testing.assert_allclose(stamps, STAMPS)
    np.testing.assert_allclose(poses[:, :3, :3], ROTATIONS.as_matrix(), atol=1e-9)
    table = np.column_stack([STAMPS, POSITIONS, QUATERNIONS, POSITIONS[::-1], WHOLE])
    table[0, 1:] = np.nan
    with pytest.warns(match="read t x y z qx qy qz qw, 4 of 12 columns ignored"):
        np.testing.assert_allclose(
            read_tum(write(lines(*rows(table)))).positions[1:], POSITIONS[1:]
        )
    with pytest.raises(FileError, match="has 7 columns, whose meaning is unknown"):
        read_tum(write(lines(*rows(STAMPS, POSITIONS, lost))))
    matrices = MATRICES.reshape(N, 12).copy()
    matrices[:5] = np.nan
    np.testing.assert_allclose(
        read_kitti(write(lines(*rows(matrices)))).positions[5:], POSITIONS[5:]
    )


def test_a_first_position_on_a_sphere_makes_no_table_of_hloc(write):
    positions = POSITIONS.copy()
    positions[0] = [0.6, 0.8, 0]
    quaternions = Rotation.from_euler("z", np.linspace(0, 1, N)[:, None]).as_quat()
    path = write(lines(*rows(NAMES, positions, quaternions)))
    assert recognise(path) == "names"
    np.testing.assert_allclose(read_names(path).positions, positions)
    path = write(lines(*rows(NAMES, W_FIRST, -ROTATIONS.apply(POSITIONS))))
    assert recognise(path) == "hloc"
    np.testing.assert_allclose(read_hloc(path).positions, POSITIONS, atol=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        lines("image_id,qw,qx,qy,qz,tx,ty,tz,camera_id,name"),
        lines(f"% {IMAGE_HEADER}"),
        lines(f"   # {IMAGE_HEADER}"),
    ],
)
@pytest.mark.filterwarnings("ignore::alignscores.io.TrajectoryWarning")
def test_the_columns_of_colmap_are_no_table_of_poses(write, text):
    """Its poses are world-to-camera, and its numbers differ from model to model."""
    by = "," if "_id," in text else " "
    translations = -ROTATIONS.inv().apply(POSITIONS)
    of_inverses = ROTATIONS.inv().as_quat()[:, [3, 0, 1, 2]]
    table = rows(RNG.permutation(N), of_inverses, translations, np.ones(N, int), NAMES, by=by)
    path = write(text + lines(*table))
    with pytest.raises(FileError, match=r"whose poses are world-to-camera.*--invert") as error:
        recognise(path)
    columns = str(error.value).split("'")[-2]
    reference = write(lines(*rows(NAMES, POSITIONS, QUATERNIONS)), "reference.txt")
    result = evaluate(reference, path, est_invert=True, est_columns=columns)
    assert result.pas == pytest.approx(1, abs=1e-6)


def test_a_comment_that_contradicts_the_rows_is_refused(write):
    """z was lost; the first seven numbers would pass for a pose without a stamp."""
    table = rows(STAMPS, POSITIONS[:, :2], QUATERNIONS)
    header = "# timestamp tx ty tz qx qy qz qw"
    with pytest.raises(FileError, match="its header names 8 columns, its first row has 7"):
        read_tum(write(lines(header, *table)))
    positions = read_tum(write(lines(header, *rows(STAMPS, POSITIONS)))).positions
    np.testing.assert_allclose(positions, POSITIONS)  # what it left out comes last


def test_a_header_may_have_blanks_in_its_units(write):
    header = "#timestamp p_x [m] p_y [m] p_z [m] q_w [] q_x [] q_y [] q_z [] v_x [m s^-1]"
    for by in (" ", "\t"):
        names = header.replace(" p_", f"{by}p_").replace(" q_", f"{by}q_").replace(" v_", f"{by}v_")
        path = write(lines(names, *rows(STAMPS, POSITIONS, W_FIRST, STAMPS, by=by)))
        with pytest.warns(match="1 of 9 columns ignored"):
            rotations = read_tum(path).rotations
        np.testing.assert_allclose(rotations, ROTATIONS.as_matrix(), atol=1e-9)


def test_plain_text_may_have_the_suffix_of_a_compressed_file(write):
    for suffix in ("xz", "lzma", "gz", "bz2"):
        path = write(lines(*rows(STAMPS, POSITIONS, QUATERNIONS)), f"a.{suffix}")
        np.testing.assert_allclose(read_tum(path).positions, POSITIONS)


def test_numbers_of_images_are_whole(write):
    """If columns are swapped, the first one or that of the camera is not."""
    good = rows(WHOLE, W_FIRST, POSITIONS, np.ones(N, int), NAMES)
    swapped = rows(POSITIONS[:, 0], W_FIRST, WHOLE, POSITIONS[:, 1:], np.ones(N, int), NAMES)
    wider = rows(WHOLE, W_FIRST, WHOLE, POSITIONS, np.ones(N, int), NAMES)
    assert len(read_colmap(write("\n\n".join(good), "images.txt")).keys) == N
    for wrong in (swapped, wider):
        with pytest.raises(FileError, match=r"line 1: must hold 'IMAGE_ID QW .*, with whole IDs"):
            read_colmap(write("\n\n".join(wrong), "images.txt"))


def test_all_rig_frames_are_read_or_none(examples, tmp_path):
    shutil.copytree(examples / "colmap/estimate", tmp_path, dirs_exist_ok=True)
    read_rig_frames(tmp_path)
    content = (tmp_path / "frames.bin").read_bytes()
    n = int.from_bytes(content[:8], "little")
    (tmp_path / "frames.bin").write_bytes((n - 1).to_bytes(8, "little") + content[8:])
    with pytest.raises(FileError, match=r"frames.bin: is cut off or damaged; --rig_frames none"):
        read_rig_frames(tmp_path)


@pytest.mark.parametrize(
    "damage",
    [
        lambda line: line.replace(" ", ","),
        lambda line: "\ufeff" + line,
        lambda line: line.replace("QUAT", "QUA"),
        lambda line: line.lower(),
        lambda line: line.removeprefix("VERTEX_SE3:QUAT "),
    ],
)
def test_no_vertex_of_a_pose_graph_is_lost(write, damage):
    vertices = [f"VERTEX_SE3:QUAT {row}" for row in rows(WHOLE, POSITIONS, QUATERNIONS)]
    others = [
        "FIX 0",
        "VERTEX_SE2 90 1 2 3",
        "Edge_V_V 0 1",
        "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1",
        "",
    ]
    assert len(read_g2o(write(lines(*vertices, *others))).keys) == N
    path = write(lines(*vertices[:9], damage(vertices[9]), *vertices[10:]))
    with pytest.raises(FileError, match="line 10: must hold 'VERTEX_SE3:QUAT id"):
        read_g2o(path)


def test_numbers_of_frames_are_kept_whole(write):
    table = rows(WHOLE, POSITIONS, by=",")
    path = write(lines("frame,x,y,z", *table[:5], "5e200,1,2,3", *table[6:]))
    with pytest.raises(FileError, match=r"line 7: the number is not within 1e\+15"):
        read_tum(path)


@pytest.mark.parametrize("wrong", [True, "3", "1_0", [1]])
def test_only_numbers_are_numbers_in_json(write, wrong):
    matrix = np.eye(4).tolist()
    matrix[0][3] = wrong
    path = write(json.dumps({"frames": [{"file_path": "a.png", "transform_matrix": matrix}]}))
    with pytest.raises(FileError, match="needs a file_path and a transform_matrix"):
        read_nerf(path)


@pytest.mark.parametrize(
    ("last_row", "reason"), [([0, 0, 0, 2], "0 0 0 1$"), ([1, 2, 3, 1], "unlike the last column")]
)
def test_the_last_row_of_a_matrix_is_checked_in_json(write, last_row, reason):
    pose = np.eye(4)
    for rows_of_pose in (3, 4):
        frames = [{"file_path": "a.png", "transform_matrix": pose[:rows_of_pose].tolist()}]
        assert len(read_nerf(write(json.dumps({"frames": frames}))).keys) == 1
    pose[3], pose[0, 3] = last_row, not last_row[0]
    frames = [{"file_path": "a.png", "transform_matrix": pose.tolist()}]
    with pytest.raises(FileError, match=f"the last row of the matrix must be .*{reason}"):
        read_nerf(write(json.dumps({"frames": frames})))


@pytest.mark.parametrize("line", ["[INFO] trajectory saved", "[ 12:30:01] start", "[]"])
def test_a_bracket_does_not_make_json(write, line):
    assert recognise(write(lines(line, *rows(STAMPS, POSITIONS, QUATERNIONS)))) == "tum"
    long = json.dumps([{"shots": {"x" * 10_000: {}}}])
    with pytest.raises(FileError, match=r"shot 'x+\.\.\.x+': needs a rotation") as error:
        read_opensfm(write(long))
    assert len(str(error.value)) < 300


def test_all_of_an_array_is_read_or_nothing(tmp_path):
    path = tmp_path / "a.npy"
    with path.open("wb") as file:
        np.save(file, MATRICES[:20])
        np.save(file, MATRICES[20:])
    with pytest.raises(FileError, match="is not a file of arrays"):
        read_arrays(path)
    lost = MATRICES.copy()
    lost[3, 1, 1] = np.nan
    np.save(path, lost)
    assert np.isnan(read_arrays(path).poses[3, :3, :3]).all()


def test_a_name_is_not_as_long_as_a_file(write, tmp_path):
    """An array would have room for it in each row."""
    long = "x" * 100_000
    matrix = np.eye(4).tolist()
    frames = [{"file_path": name, "transform_matrix": matrix} for name in (*NAMES, long)]
    images = "\n\n".join(rows(WHOLE, W_FIRST, POSITIONS, np.ones(N, int), [*NAMES[1:], long]))
    table = lines(*rows([*NAMES[1:], long], POSITIONS, QUATERNIONS))
    for read, path in (
        (read_nerf, write(json.dumps({"frames": frames}), "a.json")),
        (read_colmap, write(images, "images.txt")),
        (read_names, write(table, "names.txt")),
    ):
        with pytest.raises(FileError, match="has 100000 characters, more than 255: 'xxx") as error:
            read(path)
        assert len(str(error.value)) < 300
    rows_of_names = rows([*NAMES[1:], "x" * 256], POSITIONS, QUATERNIONS)
    with pytest.raises(FileError, match="has 256 characters, more than 255"):
        read_names(write(lines(*rows_of_names)))
    binary = np.uint64(1).tobytes() + bytes(64) + b"x" * 10_000
    (tmp_path / "images.bin").write_bytes(binary)
    with pytest.raises(FileError, match="is damaged: the name of image 0 does not end"):
        read_colmap(tmp_path / "images.bin")


def test_a_damaged_first_stamp_is_no_name(write):
    table = rows(STAMPS, POSITIONS, QUATERNIONS)
    for damaged in ("O.0", "\ufeff\ufeff0.0"):
        path = write(lines(damaged + table[0].removeprefix("0"), *table[1:]))
        with pytest.raises(FileError, match=r"line 1: '.*' is not a number, as the rows below"):
            recognise(path)


def test_an_odd_file_in_a_folder_of_matrices_is_named(tmp_path):
    for row, pose in enumerate(MATRICES):
        np.savetxt(tmp_path / f"frame-{row:06}.txt", pose)
    assert read_matrices(tmp_path).keys.tolist() == list(range(N))
    for odd in ("frame-000003 (1)", "intrinsics", "9" * 20):
        file = tmp_path / f"{odd}.txt"
        np.savetxt(file, MATRICES[3])
        with pytest.raises(FileError, match=f"only these have no number .*'{re.escape(odd)}'; ren"):
            read_matrices(tmp_path)
        file.unlink()


def test_a_name_may_hold_a_number_sign(write):
    names = [f"cam#{row}.png" for row in range(N)]
    path = write(lines(*rows(names, W_FIRST, POSITIONS, by=" ")))
    assert sorted(names) == read_hloc(path).keys.tolist()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("0 1 2 3\n".encode("utf-16-le"), "is not text .*, but binary or UTF-16; save it as UTF-8"),
        (b"0.0d0 1.0d0 2.0d0 3.0d0\n", "has no line of numbers; it begins with '0.0d0 1.0d0"),
    ],
)
def test_a_text_without_numbers_is_refused_with_its_beginning(write, content, reason):
    with pytest.raises(FileError, match=reason):
        read_tum(write(content))


def test_a_file_of_one_line_is_refused(write):
    path = write("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n#" + "x" * 20_000_000)
    with pytest.raises(FileError, match="line 2: has more than 20 million letters"):
        read_g2o(path)
