"""Kinds of files that gave a wrong number, or a wrong reason, in public reports.

The reports are named; data and wording are ours.
"""

import json
import re
import tracemalloc
import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import evaluate
from alignscores.io import (
    FileError,
    TrajectoryWarning,
    read_colmap,
    read_euroc,
    read_g2o,
    read_hloc,
    read_kitti,
    read_matrices,
    read_names,
    read_nerf,
    read_opensfm,
    read_stamps,
    read_tum,
    recognise,
)

N = 40
RNG = np.random.default_rng(0)
STAMPS = 1_700_000_000 + np.arange(N) / 10
POSITIONS = np.cumsum(RNG.normal(size=(N, 3)), axis=0).round(6)
ROTATIONS = Rotation.random(N, rng=1)
QUATERNIONS = ROTATIONS.as_quat()


def table(*columns, by=" ", header="", digits=9):
    values = np.column_stack(columns)
    rows = [by.join(f"{value:.{digits}f}" for value in row) for row in values]
    return "\n".join([*([header] if header else []), *rows, ""])


TUM = table(STAMPS, POSITIONS, QUATERNIONS)


def same_poses(trajectory, *, rotations=True):
    np.testing.assert_allclose(trajectory.positions, POSITIONS, atol=1e-8)
    if rotations:
        np.testing.assert_allclose(trajectory.rotations, ROTATIONS.as_matrix(), atol=1e-7)
    else:
        assert trajectory.rotations is None


TWO = {  # headers with two poses, and the columns that choose each
    "timestamp,gt_x,gt_y,gt_z,est_x,est_y,est_z": ("t x y z - - -", "t - - - x y z"),
    "timestamp,x_gt,y_gt,z_gt,x_est,y_est,z_est": ("t x y z - - -", "t - - - x y z"),
    "timestamp,true_pos_x,true_pos_y,true_pos_z,pos_x,pos_y,pos_z": (
        "t x y z - - -",
        "t - - - x y z",
    ),
    "timestamp,ref_x,ref_y,ref_z,x,y,z": ("t - - - x y z", "t x y z - - -"),
    "timestamp,ref_tx,ref_ty,ref_tz,tx,ty,tz": ("t - - - x y z", "t x y z - - -"),
    "t,x,y,z,x,y,z": ("t x y z - - -", "t - - - x y z"),
    "t,groundtruth.x,groundtruth.y,groundtruth.z,prediction.x,prediction.y,prediction.z": (
        "t x y z - - -",
        "t - - - x y z",
    ),
    "time,vicon_px,vicon_py,vicon_pz,slam_px,slam_py,slam_pz": ("t x y z - - -", "t - - - x y z"),
    **{
        f"t,{first},{second}": ("t x y z - - -", "t - - - x y z")
        for first, second in (
            ("x,y,z", "x_hat,y_hat,z_hat"),
            ("x,y,z", "odom_x,odom_y,odom_z"),
            ("tx,ty,tz", "tx_kf,ty_kf,tz_kf"),
            ("x,y,z", "xhat,yhat,zhat"),
            ("x2,y2,z2", "x,y,z"),
        )
    },
}
OTHERS = [  # quantities that stand next to a position
    "vx,vy,vz",
    "x_dot,y_dot,z_dot",
    "mag_x,mag_y,mag_z",
    "R_x,R_y,R_z",
    "bias_gyro_x,bias_gyro_y,bias_gyro_z",
    "x_std,y_std,z_std",
    "pxz,pyz,pzz",
    "angular_rate_x,angular_rate_y,angular_rate_z",
]


@pytest.mark.parametrize("header", TWO)
@pytest.mark.filterwarnings("ignore::alignscores.io.TrajectoryWarning")
def test_a_header_with_two_poses_is_refused_with_the_choices(write, header):
    path = write(table(STAMPS, POSITIONS + 1, POSITIONS, by=",", header=header))
    with pytest.raises(
        FileError, match="its header names 2 poses; choose one by --columns '"
    ) as caught:
        read_tum(path)
    choices = re.findall(r"'([^']+)'", str(caught.value))
    assert sorted(choices) == sorted(choice.rstrip(" -") for choice in TWO[header])
    for choice in choices:
        first = choice.startswith("t x")
        assert read_tum(path, columns=choice).positions == pytest.approx(POSITIONS + first)


@pytest.mark.parametrize("others", OTHERS)
def test_a_position_next_to_another_quantity_is_read(write, others):
    path = write(table(STAMPS, POSITIONS, POSITIONS + 1, by=",", header=f"t,x,y,z,{others}"))
    with pytest.warns(TrajectoryWarning, match="read t x y z .*, 3 of 7 columns ignored"):
        same_poses(read_tum(path), rotations=False)


def test_the_rotation_of_a_pose_has_its_owner(write):
    header = "t,x,y,z,qx,qy,qz,qw,x_slam,y_slam,z_slam,qx_slam,qy_slam,qz_slam,qw_slam"
    pose = POSITIONS, QUATERNIONS
    path = write(table(STAMPS, *pose, *pose, by=",", header=header))
    second = "t - - - - - - - x y z qx qy qz qw"
    with pytest.raises(FileError, match=f"'t x y z qx qy qz qw' or '{second}'"):
        read_tum(path)


def test_two_poses_of_the_same_names_are_not_mixed(write):
    """As pandas writes a merged table, or one with equal names."""
    header = "t,x,y,z,qx,qy,qz,qw,x_1,y_1,z_1,qx_1,qy_1,qz_1,qw_1"
    for text in (header, header.replace("_1", "")):
        path = write(
            table(STAMPS, POSITIONS, QUATERNIONS, POSITIONS, QUATERNIONS, by=",", header=text)
        )
        with pytest.raises(FileError, match="its header names 2 poses; choose one by"):
            read_tum(path)


def test_positions_and_rotations_of_two_owners_are_not_mixed(write):
    """microsoft/AirSim and others: a reference of positions next to an estimate."""
    header = "timestamp,ref_x,ref_y,ref_z,x,y,z,qx,qy,qz,qw"
    path = write(table(STAMPS, POSITIONS + 1, POSITIONS, QUATERNIONS, by=",", header=header))
    with pytest.raises(FileError, match="'t x y z' or 't - - - x y z qx qy qz qw'"):
        read_tum(path)
    header = "t,est_x,est_y,est_z,gt_qx,gt_qy,gt_qz,gt_qw"
    with pytest.warns(TrajectoryWarning, match=r"read t x y z \(in.*\), 4 of 8 columns ignored"):
        trajectory = read_tum(write(table(STAMPS, POSITIONS, QUATERNIONS, by=",", header=header)))
    same_poses(trajectory, rotations=False)


def test_other_quantities_are_no_positions(write):
    """As in the header of Project Aria's trajectories (projectaria_tools#8), but for its clocks."""
    header = (
        "graph_uid,tracking_timestamp_us,tx_world_device,ty_world_device,tz_world_device,"
        "qx_world_device,qy_world_device,qz_world_device,qw_world_device,"
        "device_linear_velocity_x_device,angular_velocity_y_device,gravity_z_world,pos_std_x"
    )
    noise = np.full((N, 4), 0.5)
    text = table(np.zeros(N), STAMPS * 1e6, POSITIONS, QUATERNIONS, noise, by=",", header=header)
    with pytest.warns(TrajectoryWarning, match=r"tx_world_device.*, 5 of \d+ columns ignored"):
        trajectory = read_tum(write(text))
    same_poses(trajectory)
    np.testing.assert_allclose(trajectory.keys, STAMPS, atol=1e-5)


@pytest.mark.filterwarnings("ignore::alignscores.io.TrajectoryWarning")
def test_two_clocks_are_not_added(write):
    """projectaria_tools#8: the time of the tracking and UTC."""
    utc, header = STAMPS * 1e9 + 5e12, "tracking_timestamp_us,utc_timestamp_ns,x,y,z"
    path = write(table(STAMPS * 1e6, utc, POSITIONS, by=",", header=header))
    with pytest.raises(FileError, match=r"names 2 clocks; .* 't_us - x y z' or '- t_ns x y z'"):
        read_tum(path)
    assert read_tum(path, columns="- t_ns x y z").keys[0] == pytest.approx(STAMPS[0] + 5000)
    path = write(table(STAMPS, utc, POSITIONS, by=",", header="sec,nsec,x,y,z"))
    with pytest.raises(FileError, match="line 2: t_ns is not a fraction of t_s"):
        read_tum(path)


def test_w_comes_first_only_where_the_file_says_so(write):
    """Only commas do not."""
    w_first = QUATERNIONS[:, [3, 0, 1, 2]]
    seconds = write(table(STAMPS, POSITIONS, QUATERNIONS, by=","), "a.csv")
    assert recognise(seconds) == "tum"
    for read in (read_tum, read_euroc):
        same_poses(read(seconds))
    nanoseconds = write(table(STAMPS * 1e9, POSITIONS, w_first, by=",", digits=9), "b.csv")
    assert recognise(nanoseconds) == "euroc"
    same_poses(read_euroc(nanoseconds))
    header = write(table(STAMPS, POSITIONS, w_first, header="#t x y z qw qx qy qz"), "c.csv")
    same_poses(read_tum(header))


@pytest.mark.parametrize("columns", [7, 8, 9])
@pytest.mark.filterwarnings("ignore::alignscores.io.TrajectoryWarning")
def test_a_quaternion_that_is_none_is_refused_in_any_row(write, columns):
    """Euler angles in their place (rpg_trajectory_evaluation#43), a rotation vector (ARKit)."""
    quaternions = QUATERNIONS.copy()
    quaternions[17] *= 1.2
    parts = [STAMPS, POSITIONS, quaternions, np.arange(N)]
    path = write(table(*(parts if columns == 9 else parts[:3] if columns == 8 else parts[1:3])))
    remedy = "'x y z' for only positions or 't rx ry rz x y z' for rotation vectors"
    if columns > 7:
        remedy = "'t x y z' for only positions or 't qx qy qz qw x y z' for another order"
    message = f"line 18: a quaternion of length 1.2 is not a rotation; .*{remedy}; Euler angles are"
    with pytest.raises(FileError, match=message):
        read_tum(path)
    with pytest.raises(FileError, match="'name x y z' for only positions or 'name qx qy"):
        read_names(write(named(POSITIONS, quaternions, header="name x y z qx qy qz qw")))


def test_rotation_vectors_are_read(write):
    """apple/ARKitScenes#37, by --columns or by a header."""
    vectors = ROTATIONS.as_rotvec()
    path = write(table(STAMPS, vectors, POSITIONS))
    with pytest.raises(FileError, match=r"has 7 columns, .* 't rx ry rz x y z'"):
        read_tum(path)
    same_poses(read_tum(path, columns="t rx ry rz x y z"))
    header = "t rx ry rz tx ty tz"
    with pytest.warns(TrajectoryWarning, match="as a rotation vector in radians; Euler angles"):
        same_poses(read_tum(write(table(STAMPS, vectors, POSITIONS, header=header))))
    degrees = write(table(STAMPS, np.degrees(vectors), POSITIONS, header=header))
    with pytest.raises(FileError, match=r"line 2: a rotation vector of length .* in radians"):
        read_tum(degrees, columns=header)


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize(("height", "unit"), [(0.0, 1), (3.0, 1), (3.0, np.pi / 180)])
def test_latitudes_and_longitudes_are_recognised(write, swapped, height, unit):
    """evo#420: without a header. Metres far from the origin are not refused."""
    degrees = unit * (np.array([48.98, 8.39]) + POSITIONS[:, :2] / 1e4)
    degrees = degrees[:, ::-1] if swapped else degrees
    z = 112 + height * POSITIONS[:, 2]
    path = write(table(STAMPS, degrees, z))
    with pytest.raises(FileError, match="seems to have latitudes and longitudes"):
        read_tum(path)
    assert len(read_tum(path, columns="t x y z").keys) == N
    for offset in ([48.98, 8.39, 112], [450_000, 5_400_000, 100]):
        assert len(read_tum(write(table(STAMPS, POSITIONS + offset))).keys) == N
    named = table(STAMPS, degrees, z, by=",", header="t,x,y,z")
    with pytest.raises(FileError, match="seems to have latitudes and longitudes"):
        read_tum(write(named))
    still = [0.5, 0.3, 0.2] + POSITIONS / 1e4
    assert len(read_tum(write(table(STAMPS, still))).keys) == N


@pytest.mark.parametrize("in_degrees", [False, True])
@pytest.mark.parametrize("first", [-np.pi, 0])
def test_headings_of_planar_robots_are_no_heights(write, in_degrees, first):
    heading = (np.arange(N) / 5 - first) % (2 * np.pi) + first
    z = np.degrees(heading) if in_degrees else heading
    for stamps, names in ([[STAMPS], "t x y z"], [[], "x y z"]):
        path = write(table(*stamps, POSITIONS[:, :2], z))
        with pytest.raises(FileError, match=r"z jumps by .* as a heading does; write a heading as"):
            read_tum(path)
        assert len(read_tum(path, columns=names).keys) == N
    for height in (heading / 2, np.unwrap(heading), 1.1 * heading):
        assert len(read_tum(write(table(STAMPS, POSITIONS[:, :2], height))).keys) == N


@pytest.mark.parametrize("rows", [3, 4])
def test_matrices_in_several_lines_are_named(write, rows):
    """ICL-NUIM's .gt.sim files, and dumps of arrays."""
    matrices = np.tile(np.eye(4), (N, 1, 1))
    matrices[:, :3] = np.concatenate([ROTATIONS.as_matrix(), POSITIONS[:, :, None]], axis=2)
    blocks = "\n".join(table(matrix[:rows]) for matrix in matrices)
    with pytest.raises(FileError, match="seems to have a matrix in several lines; write each in"):
        read_tum(write(blocks))
    with pytest.raises(FileError, match="must be 0 0 0 1, unlike the last column: transpose it"):
        read_tum(write(table(matrices.transpose(0, 2, 1).reshape(N, 16))))


@pytest.mark.parametrize("rotations", [ROTATIONS, Rotation.from_rotvec(0 * POSITIONS)])
def test_matrices_in_other_orders_are_refused_with_the_columns(write, rotations):
    """A rotation before or behind a position is no 3 x 4 matrix, and no quaternion."""
    matrix, more = rotations.as_matrix().reshape(N, 9), np.ones((N, 2))
    order = " ".join(f"r{i}{j}" for i in "123" for j in "123")
    for parts, names in (
        ([matrix, POSITIONS], f"{order} x y z"),
        ([POSITIONS, matrix], f"x y z {order}"),
        ([STAMPS, matrix, POSITIONS], f"t {order} x y z"),
        ([STAMPS, POSITIONS, matrix], f"t x y z {order}"),
        ([STAMPS, matrix, POSITIONS, more], f"t {order} x y z"),
        ([np.arange(N), STAMPS, matrix, POSITIONS], f"n t {order} x y z"),
    ):
        path = write(table(*parts))
        message = rf"seem to be a rotation matrix; name them, as in --columns '{names}'"
        with pytest.raises(FileError, match=message):
            read_tum(path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            trajectory = read_tum(path, columns=names)
        np.testing.assert_allclose(trajectory.positions, POSITIONS, atol=1e-8)
        np.testing.assert_allclose(trajectory.rotations, rotations.as_matrix(), atol=1e-7)
    covariances = np.tile(np.eye(3).ravel(), (N, 1))
    with pytest.warns(TrajectoryWarning, match="9 of 17 columns ignored"):
        same_poses(read_tum(write(table(STAMPS, POSITIONS, QUATERNIONS, covariances))))


@pytest.mark.filterwarnings("ignore::alignscores.io.TrajectoryWarning")
def test_a_first_column_that_is_not_in_order_is_no_time(write):
    """A matrix that lacks a number has a unit quaternion in its fifth to eighth columns, almost."""
    small = Rotation.from_rotvec(0.02 * RNG.normal(size=(N, 3))).as_matrix()
    matrices = np.concatenate([small, 0.1 * POSITIONS[:, :, None]], axis=2).reshape(N, 12)
    matrices[:, 7] = 0
    for width in (9, 11):
        path = write(table(matrices[:, :width]))
        with pytest.raises(FileError, match=f"has {width} columns, and the first is no time"):
            read_tum(path)


@pytest.mark.filterwarnings("ignore::alignscores.io.TrajectoryWarning")
def test_wide_tables_without_a_quaternion_are_refused(write):
    """A number, a matrix and a column of nan would pass for a pose whose rotation is lost."""
    matrices = np.concatenate([ROTATIONS.as_matrix(), POSITIONS[:, :, None]], axis=2)
    parts = np.arange(N), matrices.reshape(N, 12)[:, :4], np.full(N, np.nan), POSITIONS
    with pytest.raises(FileError, match="has 9 columns, whose meaning is unknown; name them"):
        read_tum(write(table(*parts)))


def test_a_header_names_all_columns(write):
    """R writes no name for the first column; joined rows have twice as many fields.

    A comment may leave out the last columns.
    """
    for header, by in (("time,x,y,z", ","), ("time x y z", " ")):
        for first, second in (([np.arange(N)], []), ([], [STAMPS, POSITIONS])):
            path = write(table(*first, STAMPS, POSITIONS, *second, by=by, header=header))
            message = "its header names 4 columns, its first row has [58]; name them, as in"
            with pytest.raises(FileError, match=message):
                read_tum(path)
    path = write(table(STAMPS, POSITIONS, np.ones(N), header="# time x y z"))
    with pytest.warns(TrajectoryWarning, match="time x y z.*, 1 of 5 columns ignored"):
        same_poses(read_tum(path), rotations=False)


def test_headers_with_thousands_of_names_are_refused_in_a_sentence(write):
    """All choices of 400 positions and 1000 clocks would take minutes and gigabytes."""
    header = ",".join(["t"] * 1000 + ["x", "y", "z"] * 400)
    path = write(table(np.ones((3, 2200)), by=",", header=header))
    tracemalloc.start()
    try:
        with pytest.raises(FileError, match="its header names 400 poses; choose one") as caught:
            read_tum(path)
        assert tracemalloc.get_traced_memory()[1] < 100e6
    finally:
        tracemalloc.stop()
    assert len(str(caught.value)) < 2000


def test_blank_lines_may_separate_a_header_from_its_units(write):
    path = write("t,x,y,z\n\ns,mm,mm,mm\n\n" + table(STAMPS, 1000 * POSITIONS, by=","))
    with pytest.warns(TrajectoryWarning, match="converted from mm, as its columns say"):
        same_poses(read_tum(path), rotations=False)


NAMES_OF_TUM = "timestamp tx ty tz qx qy qz qw"


@pytest.mark.parametrize(
    "header",
    [
        f"{NAMES_OF_TUM}\n# -------\ns mm mm mm - - - -",
        f"# {NAMES_OF_TUM}\n#\n# s mm mm mm - - - -",
        f"# {NAMES_OF_TUM}\n# s mm mm mm [] [] [] []",
        "timestamp tx_mm ty_mm tz_mm qx qy qz qw\n# m",
    ],
)
def test_a_rule_does_not_hide_a_line_of_units(write, header):
    path = write(table(STAMPS, 1000 * POSITIONS, QUATERNIONS, header=header))
    with pytest.warns(TrajectoryWarning, match="converted from mm, as its columns say"):
        same_poses(read_tum(path))


@pytest.mark.parametrize(
    ("header", "reason"),
    [
        (f"# {NAMES_OF_TUM}\n# [s] [mm] [mm] [mm]", "names 8 columns, the line of their units 4"),
        ("timestamp tx[nm] ty[nm] tz[nm] qx qy qz qw", r"a unit that is unknown, 'tx\[nm\]'"),
        (f"# {NAMES_OF_TUM}\n# [s] [mil] [mil] [mil] [] [] [] []", "a unit that is unknown, 'tx "),
        *[(f"{above}-- -- -- -- -- -- -- --", "neither names nor") for above in ("", "# a\n")],
        (f"{NAMES_OF_TUM}\n١ ٢ ٣ ٤ ٥ ٦ ٧ ٨", "neither names nor numbers; delete it, or write nan"),
    ],
)
def test_a_line_below_the_header_that_is_no_unit_is_refused(write, header, reason):
    with pytest.raises(FileError, match=reason):
        read_tum(write(table(STAMPS, POSITIONS, QUATERNIONS, header=header)))


@pytest.mark.parametrize("header", ["t x y tx ty tz qx qy qz qw", "t tx ty tz qx qy qx qz qw z"])
def test_headers_that_repeat_only_some_coordinates_are_refused(write, header):
    path = write(table(STAMPS, POSITIONS, POSITIONS, RNG.normal(size=(N, 3)), header=header))
    message = "its header names 2 columns [xyz], but 1 [xyz]; name them, as in --columns"
    with pytest.raises(FileError, match=message):
        read_tum(path)
    for header in ("timestamp tx ty tz qx qx qz qw", "timestamp tx ty tz qx qy qw qw"):
        path = write(table(STAMPS, POSITIONS, QUATERNIONS, header=header))
        with pytest.raises(FileError, match=r"its header names 2 columns q[xw], but 0 q[yz]; name"):
            read_tum(path)
    path = write(table(STAMPS, POSITIONS, header="t gt_x gt_y est_z"))
    with pytest.raises(FileError, match="names x, y and z, but not of the same position; name"):
        read_tum(path)


@pytest.mark.parametrize("header", ["", "# timestamp tx ty tz qx qy qz qw"])
def test_two_poses_a_line_are_refused_with_the_choices(write, header):
    """TUM's associate.py joins lines of two files."""
    pose = STAMPS, POSITIONS, QUATERNIONS
    path = write(table(STAMPS + 0.01, POSITIONS + 1, QUATERNIONS, *pose, header=header))
    tum = "t x y z qx qy qz qw"
    choices = f"'{tum}' or '- - - - - - - - {tum}'"
    with pytest.raises(FileError, match=f"seems to have two poses a line; .* --columns {choices}"):
        read_tum(path)
    with pytest.warns(TrajectoryWarning, match="8 of 16 columns ignored"):
        same_poses(read_tum(path, columns=f"- - - - - - - - {tum}"))


def test_two_poses_of_one_stamp_are_refused_with_the_choices(write):
    """A merged table, with or without a second rotation, in the same frame or in another."""
    tum, gap = "t x y z qx qy qz qw", "t - - - - - - -"
    moved = ROTATIONS[0].apply(POSITIONS), (ROTATIONS[0] * ROTATIONS).as_quat()
    noise = RNG.normal(scale=0.02, size=(N, 3))
    velocities = np.gradient(POSITIONS, axis=0)
    for by, second, choice in (
        (" ", [POSITIONS, QUATERNIONS], f"{gap} x y z qx qy qz qw"),
        (",", [*moved, np.ones(N)], f"{gap} x y z qx qy qz qw"),
        (" ", [POSITIONS + noise], f"{gap} x y z"),
        (" ", [velocities, POSITIONS + noise], f"{gap} - - - x y z"),
        (" ", [moved[1]], "t x y z - - - - qx qy qz qw"),
    ):
        path = write(table(STAMPS, POSITIONS, QUATERNIONS, *second, by=by))
        with pytest.raises(
            FileError, match=f"two poses a line; .* --columns '{tum}' or '{choice}'"
        ):
            read_tum(path)
        with pytest.warns(TrajectoryWarning, match="columns ignored"):
            assert len(read_tum(path, columns=choice).keys) == N


def test_separators_at_the_end_of_each_row_hold_no_second_pose(write):
    rows = table(STAMPS, POSITIONS, QUATERNIONS, by=",").replace("\n", ",,,\n")
    with pytest.warns(TrajectoryWarning, match="2 of 10 columns ignored"):
        same_poses(read_tum(write(rows)))


def test_huge_numbers_beside_a_pose_give_no_other_warning(write):
    others = np.full((N, 4), 1e200)
    with pytest.warns(TrajectoryWarning, match="4 of 12 columns ignored"):
        read_tum(write(table(STAMPS, POSITIONS, QUATERNIONS, others)))


def test_other_columns_without_a_name_are_no_second_pose(write):
    small = 0.02 * RNG.normal(size=(N, 3))
    covariances = np.tile(np.eye(6).ravel(), (N, 1))
    for others in ([small, np.ones(N)], [np.gradient(POSITIONS, axis=0), small], [covariances]):
        with pytest.warns(TrajectoryWarning, match="read t x y z qx qy qz qw, .* ignored"):
            same_poses(read_tum(write(table(STAMPS, POSITIONS, QUATERNIONS, *others))))


def test_stamps_before_planar_positions_are_no_positions(write):
    path = write(table(STAMPS, POSITIONS[:, :2]))
    with pytest.raises(FileError, match=r"x is near 1.7e\+09, which is no position in metres; --"):
        read_tum(path)
    assert len(read_tum(path, columns="x y z").keys) == N


@pytest.mark.parametrize("epoch", [0, 11_644_473_600, 62_135_596_800])
def test_ticks_of_100_nanoseconds_are_recognised(write, epoch):
    """HoloLens and Windows count them from 1601, .NET and Cartographer from the year 1."""
    rows = table(POSITIONS, QUATERNIONS).splitlines()
    ticks = (np.round(STAMPS * 10).astype(np.int64) + 10 * epoch) * 10**6
    path = write([f"{stamp} {row}" for stamp, row in zip(ticks, rows, strict=True)])
    with pytest.warns(TrajectoryWarning, match="time stamps in ticks of 100 ns, as their size"):
        trajectory = read_tum(path)
    same_poses(trajectory)
    np.testing.assert_allclose(trajectory.keys, STAMPS + epoch, atol=1e-4)


@pytest.mark.parametrize("start", [0, 171_234_567_890_123, 1_234_567_890_123_456])
@pytest.mark.parametrize("rate", [10, 30, 200])
def test_nanoseconds_since_a_start_are_recognised(write, start, rate):
    """ARCore and ROS without a simulated clock: since a phone or a computer was switched on."""
    rows = table(POSITIONS, QUATERNIONS).splitlines()
    step = 10**9 // rate
    path = write([f"{start + step * number} {row}" for number, row in enumerate(rows)])
    with pytest.warns(TrajectoryWarning, match="time stamps in ns, as their size shows"):
        trajectory = read_tum(path)
    np.testing.assert_allclose(trajectory.keys, start / 1e9 + np.arange(N) / rate, atol=1e-6)


def world_to_camera():
    inverse = ROTATIONS.inv()
    return inverse, -inverse.apply(POSITIONS)


NAMES = [f"my photos/{number:03}.jpg" for number in range(N)]


def named(*columns, header="", by=" "):
    lines = table(*columns, by=by).splitlines()
    rows = [f"{name}{by}{line}" for name, line in zip(NAMES, lines, strict=True)]
    return "\n".join([*([header] if header else []), *rows[::-1], ""])


def test_the_results_of_hloc_are_read(write):
    """Hierarchical-Localization#109: world-to-camera, w first, by image name."""
    rotations, translations = world_to_camera()
    text = named(rotations.as_quat(scalar_first=True), translations)
    for above in ("# localised by hloc", ""):
        assert recognise(write(f"{above}\n{text}")) == "hloc"
    path = write(text)
    assert recognise(path) == "hloc"
    for read in (read_hloc, read_colmap):
        trajectory = read(path)
        assert trajectory.keys.tolist() == NAMES
        same_poses(trajectory)
    assert evaluate(path, path).pas == 1


def test_tables_of_image_names_are_read(write):
    matrices = np.concatenate([ROTATIONS.as_matrix(), POSITIONS[:, :, None]], axis=2)
    w_first = QUATERNIONS[:, [3, 0, 1, 2]]
    header = "image,qw,qx,qy,qz,tx,ty,tz"
    for text in (
        named(POSITIONS, QUATERNIONS),
        named(matrices.reshape(N, 12)),
        named(w_first, POSITIONS, by=",", header=header),
        named(w_first, POSITIONS, by=",", header=header.replace("image", "#PhotoID")),
    ):
        path = write(text)
        assert recognise(path) == "names"
        trajectory = read_names(path)
        assert trajectory.keys.tolist() == NAMES
        same_poses(trajectory)
    path = write(named(w_first, POSITIONS))
    same_poses(read_names(path, columns="name qw qx qy qz x y z"))
    path = write(named(POSITIONS, QUATERNIONS).replace("017.jpg", "01;7,a.jpg"))
    assert "my photos/01;7,a.jpg" in read_names(path).keys
    path = write(named(POSITIONS, np.ones(N), by=",", header="image,x,y,z,score"))
    with pytest.warns(TrajectoryWarning, match=r"read name x y z \(in.*\), 1 of 5 columns ignored"):
        same_poses(read_names(path), rotations=False)


@pytest.mark.parametrize(
    ("header", "name"), [("image", "{:06}"), ("frame", "img_{:06}.png"), ("frame_id", "left{:06}")]
)
def test_what_differs_by_row_is_a_key(write, header, name):
    """Numbers of images, and names of frames; but not a constant frame_id, as of ROS."""
    rows = table(POSITIONS, QUATERNIONS, by=",").splitlines()
    lines = [f"{name.format(row)},{line}" for row, line in enumerate(rows)]
    names = f"{header},x,y,z,qx,qy,qz,qw"
    reference = write([names, *lines], "reference.csv")
    path = write([names, *lines[10:], *lines[:10]], "est.csv")
    assert read_names(path).keys.tolist() == [name.format(row) for row in range(N)]
    assert evaluate(reference, path).pas == 1
    with pytest.warns(TrajectoryWarning, match="1 of 8 columns ignored"):
        trajectory = read_tum(write([names, *(f"map,{line}" for line in rows)]))
    assert trajectory.keys.tolist() == list(range(N))


def test_two_rows_that_a_lost_line_break_joins_are_refused(write):
    """Also where not all columns are read, and where a name could hold the numbers."""
    lines = table(STAMPS, POSITIONS, QUATERNIONS, np.ones((N, 2))).splitlines()
    lines[5:7] = [f"{lines[5]} {lines[6]}"]
    with pytest.raises(FileError, match="line 6: has 20 columns, the first row 10"):
        read_tum(write(lines))
    lines = named(QUATERNIONS, POSITIONS).splitlines()
    lines[5:7] = [lines[5] + lines[6]]
    with pytest.raises(FileError, match="line 6: has"):
        read_hloc(write(lines))


def frames(names):
    poses = np.tile(np.eye(4), (len(names), 1, 1))
    poses[:, :3, 3] = POSITIONS[: len(names)]
    return json.dumps(
        {
            "frames": [
                {"file_path": name, "transform_matrix": pose.tolist()}
                for name, pose in zip(names, poses, strict=True)
            ]
        }
    )


def test_duplicates_of_any_key_are_said_and_a_tenth_is_refused(write):
    two_duplicates, five_duplicates = [*NAMES[:38], NAMES[0], NAMES[1]], [*NAMES[:35], *NAMES[:5]]
    message = (
        r"frames\[38\] .*: 2 of 40 poses have the name of another one, such as my photos/000.jpg"
    )
    with pytest.warns(TrajectoryWarning, match=f"{message}; the first one is used"):
        read_nerf(write(frames(two_duplicates)))
    with pytest.raises(FileError, match=r"5 of 40 poses have the name .*; write each pose once"):
        read_nerf(write(frames(five_duplicates)))
    numbers = np.arange(N)
    numbers[-1] = 0
    header = "# frame x y z qx qy qz qw"
    with pytest.warns(TrajectoryWarning, match="line 41: 1 of 40 pose has the number of another"):
        read_tum(write(table(numbers, POSITIONS, QUATERNIONS, header=header)))
    whole = table(np.floor(STAMPS), POSITIONS, QUATERNIONS)  # evo#331
    with pytest.raises(
        FileError, match=r"line 2: 36 of 40 poses have the time stamp .* all their d"
    ):
        read_tum(write(whole))


def test_two_runs_in_a_file_are_refused(write):
    """evo#260. Rows that are merely out of order are sorted by whoever matches them."""
    lines = TUM.splitlines()
    again = table(STAMPS + 0.05, POSITIONS, QUATERNIONS).splitlines()
    with pytest.raises(FileError, match=r"line 41: the time stamps jump back by 3.85 s: the file"):
        read_tum(write([*lines, *again]))
    shuffled = RNG.permutation(lines).tolist()
    assert len(read_tum(write(shuffled)).keys) == N
    maps = [*lines[25:], *lines[:25]]  # of one run, the second first
    assert len(read_tum(write(maps)).keys) == N
    swapped = [*lines[:10], lines[35], *lines[11:35], lines[10], *lines[36:]]
    for late in (swapped, [*lines, lines[5].replace(".5", ".45", 1)]):
        assert len(read_tum(write(late)).keys) == len(late)


def test_a_stamp_that_is_no_time_is_refused(write):
    lines = TUM.splitlines()
    lines[7] = " ".join(["1e18", *lines[7].split()[1:]])
    with pytest.raises(
        FileError, match=r"line 8: the time stamp of 1e\+18 s is not a time; most are"
    ):
        read_tum(write(lines))
    with pytest.raises(FileError, match="line 8: the time stamp"):
        read_stamps(write(lines))
    for name, factor, unit in (("t_s", 1e3, "ms"), ("t_ms", 1e9, "ns")):
        path = write(table(STAMPS * factor, POSITIONS, header=f"# {name} x y z"))
        message = f"time stamp of 1.7e.* most seem to be in {unit}; --columns names .* t_{unit}$"
        with pytest.raises(FileError, match=message):
            read_tum(path)
        same_poses(read_tum(path, columns=f"t_{unit} x y z"), rotations=False)


def test_keys_of_a_factor_graph_are_no_times(write):
    """lajoiepy/cslam_experiments#15."""
    rows = table(POSITIONS, QUATERNIONS).splitlines()
    lines = [f"{18295873486192640 + row} {line}" for row, line in enumerate(rows)]
    message = "line 1: the time stamps count by one, from 18295873486192640 .*; no --t_offset can"
    with pytest.raises(FileError, match=message):
        read_tum(write(lines))


SPELLINGS = ["-1.#IND", "1.#QNAN", "-1.#IND00", "-1.#INF", "nan", "-nan(ind)", "NaN", "-inf", ""]


@pytest.mark.parametrize("nan", SPELLINGS)
def test_numbers_that_are_not_finite_have_many_spellings(write, nan):
    lines = table(STAMPS, POSITIONS, QUATERNIONS, by=",").splitlines()
    stamp = lines[3].split(",")[0]
    lines[3] = ",".join([stamp, *[nan] * 7])
    trajectory = read_tum(write(lines))
    assert np.isnan(trajectory.poses[3, :3]).all()
    assert np.isfinite(np.delete(trajectory.poses, 3, axis=0)).all()
    if nan:
        trajectory = read_tum(write([line.replace(",", " ") for line in lines]))
        assert np.isnan(trajectory.poses[3, :3]).all()
        lost = f"{nan} 2 3"  # counts as lost as a whole
        rows = [f"{stamp} {lost if row == 3 else '1 2 3'}" for row, stamp in enumerate(STAMPS)]
        assert np.isnan(read_tum(write(rows)).poses[3, :3]).all()
        _, poses = read_kitti(write([" ".join([nan] * 12), "1 0 0 4 0 1 0 5 0 0 1 6"]))
        assert np.isfinite(poses[:, 0, 3]).tolist() == [False, True]


@pytest.mark.parametrize("number", ["1_000", "0x10", "1e", "1,5", "١", '1"5', '15"'])
def test_spellings_of_other_languages_are_no_numbers(write, number):
    with pytest.raises(FileError, match="line 2: "):
        read_tum(write(f"{POSE}1 {number} 2 3 0 0 0 1\n"))


POSE = "0 1 2 3 0 0 0 1\n"


def images(*, points, name="{}.png"):
    rotations, translations = world_to_camera()
    rows = table(rotations.as_quat(scalar_first=True), translations).splitlines()
    lines = []
    for number, row in enumerate(rows):
        lines += [f"{number + 1} {row} 1 {name.format(number)}", *points]
    return "\n".join([*lines, ""])


@pytest.mark.parametrize("name", ["{}.png", "my image {}.png", "a b c {}.png"])
def test_no_image_of_a_text_model_is_lost(tmp_path, name):
    for points in ([""], ["1.5 2.5 -1 3 4 17"]):
        (tmp_path / "images.txt").write_text(images(points=points, name=name))
        assert len(read_colmap(tmp_path).keys) == N
    (tmp_path / "images.txt").write_text(images(points=[], name=name))
    with pytest.raises(FileError, match=r"images.txt, line 2: expected the line of 2D points"):
        read_colmap(tmp_path)


@pytest.mark.parametrize("name", ["images.txt", "gt_images.txt"])
@pytest.mark.parametrize(
    "comments", ["#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n", "", "# images\n"]
)
def test_the_file_of_images_of_a_model_is_no_table(write, name, comments):
    """Its columns are named in a comment, but its poses are world-to-camera."""
    path = write(comments + images(points=[""]), name)
    assert recognise(path) == "colmap"
    trajectory = read_colmap(path)
    assert trajectory.keys[0] == "0.png"
    order = [int(key.removesuffix(".png")) for key in trajectory.keys]
    np.testing.assert_allclose(trajectory.positions, POSITIONS[order], atol=1e-7)


def test_numbered_matrices_are_a_table(write):
    """Rounding leaves exponents where a name would be."""
    rows = [f"{n} 1 0 0 {n} 0 1 0 0 -5e-17 -1e-17 1 0\n" for n in range(9)]
    assert recognise(write("".join(rows))) == "tum"


def test_a_table_with_labels_has_no_images_of_a_model(write):
    rows = [f"{n / 10} 1 2 3 0 0 0 1 0 camera_a\n" for n in range(9)]
    assert recognise(write("".join(rows))) != "colmap"


def test_the_first_of_two_images_of_a_name_counts(tmp_path):
    lines = images(points=[""]).splitlines()
    lines[74] = lines[74].replace("37.png", "2.png")
    for text in (lines, [*lines[74:76], *lines[:74], *lines[76:]]):
        (tmp_path / "images.txt").write_text("\n".join(text))
        with pytest.warns(TrajectoryWarning, match="have the name|has the name"):
            names, poses = read_colmap(tmp_path)
        first = 2 if text is lines else 37
        np.testing.assert_allclose(poses[names == "2.png"][0, :3, 3], POSITIONS[first], atol=1e-7)


def test_a_binary_file_of_images_is_recognised(examples):
    assert recognise(examples / "colmap/estimate/images.bin") == "colmap"


@pytest.mark.parametrize(
    ("count", "reason"),
    [
        (2**63 + 1, r"is cut off: it holds 37 of its 9223372036854775809 images"),
        (38, "is cut off: it holds 37 of its 38 images"),
        (18, r"is damaged: \d+ bytes follow the last of its 18 images"),
        (0, r"is damaged: \d+ bytes follow the last of its 0 images"),
    ],
)
def test_a_binary_model_has_as_many_images_as_it_says(examples, tmp_path, count, reason):
    content = (examples / "colmap/estimate/images.bin").read_bytes()
    (tmp_path / "images.bin").write_bytes(count.to_bytes(8, "little") + content[8:])
    with pytest.raises(FileError, match=f"images.bin: {reason}"):
        read_colmap(tmp_path)


def test_the_reconstructions_of_opensfm_are_read(write):
    """mapillary/OpenSfM#1032: the largest of several, world-to-camera, by image name."""
    rotations, translations = world_to_camera()
    vectors = rotations.as_rotvec()
    shots = {
        f"{row:03}.jpg": {"rotation": list(vectors[row]), "translation": list(translations[row])}
        for row in range(N)
    }
    small_model = dict(list(shots.items())[:7])
    path = write(
        json.dumps([{"cameras": {}, "shots": small_model}, {"cameras": {}, "shots": shots}])
    )
    assert recognise(path) == "opensfm"
    with pytest.warns(TrajectoryWarning, match="has 2 reconstructions, of 7, 40 images; the larg"):
        trajectory = read_opensfm(path)
    assert trajectory.keys.tolist() == list(shots)
    same_poses(trajectory)
    for broken in ({"rotation": [0, 0]}, 3, {"rotation": [0, 0, 0], "translation": "x"}):
        with pytest.raises(FileError, match="shot 'a': needs a rotation and a translation"):
            read_opensfm(write(json.dumps([{"shots": {"a": broken}}])))


def test_pose_graphs_of_g2o_are_read(write):
    """koide3/hdl_graph_slam#122: the vertices, not the edges."""
    rows = table(POSITIONS, QUATERNIONS).splitlines()
    vertices = [f"VERTEX_SE3:QUAT {row} {line}" for row, line in enumerate(rows)]
    path = write([*vertices, "FIX 0", "EDGE_SE3:QUAT 0 1 1 2 3 0 0 0 1 1 0 0"])
    assert recognise(path) == "g2o"
    for first in ("# a graph", "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1"):
        assert recognise(write([first, *vertices], "b.g2o")) == "g2o"
    trajectory = read_g2o(path)
    assert trajectory.keys.tolist() == list(range(N))
    same_poses(trajectory)
    with pytest.raises(FileError, match=r"line 1: a quaternion of length 2 is not a rotation$"):
        read_g2o(write("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 2\n"))
    with pytest.raises(FileError, match="line 41: must hold 'VERTEX_SE3:QUAT id x y z"):
        read_g2o(write([*vertices, "VERTEX_SE3:QUAT 1 2"]))
    with pytest.raises(FileError, match="line 41: must hold 'VERTEX_SE3:QUAT id x y z"):
        read_g2o(write([*vertices, f"VERTEX_SE3:QUAT {2**63} 0 0 0 0 0 0 1"]))
    with pytest.raises(FileError, match=r"is a pose graph of g2o without VERTEX_SE3:QUAT"):
        read_g2o(write("VERTEX_SE2 0 1 2 3\n"))


@pytest.mark.parametrize(
    ("first", "name"),
    [
        ("Format Version,1.23,Take Name,a", "OptiTrack's Motive"),
        ("NVM_V3", "VisualSFM's NVM"),
        ("# Bundle file v0.3", "Bundler's bundle.out"),
        ('<?xml version="1.0"?>', "XML, such as GPX or KML"),
    ],
)
def test_files_of_other_programs_are_refused_by_name(write, first, name):
    with pytest.raises(FileError, match=f"is .*{name}, which is not read; write a table 'time"):
        recognise(write([first, "1 2 3 4"]))


def test_submissions_to_the_image_matching_challenge_are_named(write):
    header = "dataset,scene,image,rotation_matrix,translation_vector"
    row = "phototourism,church,a.png,1;0;0;0;1;0;0;0;1,0.5;0.25;1"
    with pytest.raises(FileError, match="is a submission to the Image Matching Challenge"):
        recognise(write([header, row]))


def test_matrices_are_matched_by_number_not_by_the_order_of_names(tmp_path):
    """HI-SLAM2#32: unpadded names, and -inf where there is no pose."""
    for number in range(12):
        pose = np.full((4, 4), -np.inf) if number == 3 else np.eye(4)
        pose[0, 3] = -np.inf if number == 3 else number
        np.savetxt(tmp_path / f"{number}.txt", pose)
    trajectory = read_matrices(tmp_path)
    assert trajectory.keys.tolist() == list(range(12))
    assert np.flatnonzero(~np.isfinite(trajectory.positions[:, 0])).tolist() == [3]


def test_matrices_of_time_stamps_are_matched_by_their_names(tmp_path):
    for name in ("17.25", "17.5", "18.25"):
        np.savetxt(tmp_path / f"{name}.txt", np.eye(4))
    assert read_matrices(tmp_path).keys.tolist() == ["17.25", "17.5", "18.25"]


def test_matrices_may_be_in_one_line(tmp_path):
    for number in range(4):
        pose = np.eye(4)
        pose[0, 3] = number
        np.savetxt(tmp_path / f"{number}.txt", pose.reshape(1, -1))
    assert read_matrices(tmp_path).positions[:, 0].tolist() == [0, 1, 2, 3]


def test_quaternions_of_zeros_are_no_rotations(write):
    zeros = np.zeros((N, 4))
    with pytest.warns(TrajectoryWarning, match="all quaternions are zero"):
        same_poses(read_tum(write(table(STAMPS, POSITIONS, zeros))), rotations=False)
    quaternions = QUATERNIONS.copy()
    quaternions[3] = 0
    with pytest.warns(TrajectoryWarning, match="1 pose has a quaternion of zeros: not estimated"):
        trajectory = read_tum(write(table(STAMPS, POSITIONS, quaternions)))
    assert np.flatnonzero(np.isnan(trajectory.positions[:, 0])).tolist() == [3]
