"""Text tables are read whatever their separators, units, headers and orders of columns are.

A case writes the same five poses in some layout. What is ambiguous is refused in one sentence.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores.io import FileError, read_euroc, read_kitti, read_names, read_tum, recognise

N = 5
STAMPS = 1_700_000_000 + np.arange(N) / 8
POSITIONS = np.random.default_rng(0).random((N, 3)).round(6)
ROTATIONS = Rotation.random(N, rng=0).as_matrix()
VALUES = {
    **dict(zip("xyz", POSITIONS.T, strict=True)),
    **dict(zip(["qx", "qy", "qz", "qw"], Rotation.from_matrix(ROTATIONS).as_quat().T, strict=True)),
    **{f"r{i}{j}": ROTATIONS[:, i - 1, j - 1] for i in (1, 2, 3) for j in (1, 2, 3)},
    **{f"r4{j}": np.full(N, float(j == 4)) for j in (1, 2, 3, 4)},
    **{
        f"t_{unit}": STAMPS * factor
        for unit, factor in zip(
            ["s", "ms", "us", "ticks", "ns"], [1, 1e3, 1e6, 1e7, 1e9], strict=True
        )
    },
    "whole": np.floor(STAMPS),
    "rest_ns": (STAMPS % 1) * 1e9,
    "minutes": STAMPS / 60,
    "days": [f"{stamp / 86400:.12f}" for stamp in STAMPS],
    **dict(zip(["x_mm", "y_mm", "z_mm"], POSITIONS.T * 1e3, strict=True)),
    **dict(zip(["x_inch", "y_inch", "z_inch"], POSITIONS.T / 0.0254, strict=True)),
    "n": np.arange(N) * 3,
    "-": np.full(N, 0.25),
    "word": np.full(N, "map"),
    "label": np.full(N, "run 1"),
    "quoted_t": [f'"{stamp:.3f}' for stamp in STAMPS],
}
Q, W = "x y z qx qy qz qw", "x y z qw qx qy qz"
MATRIX = "r11 r12 r13 x r21 r22 r23 y r31 r32 r33 z"
EUROC = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
    "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1]"
)
ROSTOPIC = (
    "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.position.x,"
    "field.pose.position.y,field.pose.position.z,field.pose.orientation.x,"
    "field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w"
)


def made(columns, separator=" ", header="", *, named=None, end="", decimal=".", holds=None):
    """A text with five poses in these columns, how they are named, and what the file holds."""

    def text(value):
        return value if isinstance(value, str) else f"{value:.9f}".replace(".", decimal)

    values = [VALUES[name] for name in columns.split()]
    rows = [separator.join(map(text, row)) + end for row in zip(*values, strict=True)]
    return "\n".join([*([header] if header else []), *rows, ""]), named, holds or columns


TUM, NS = f"t_s {Q}", f"t_ns {Q}"
READ = {
    **{
        f"{name}: {columns}": made(columns, separator)
        for name, separator in (
            ("blanks", "  "),
            ("tabs", "\t"),
            ("commas", ","),
            ("commas and blanks", ", "),
            ("semicolons", ";"),
        )
        for columns in (TUM, "t_s x y z", "x y z", Q, MATRIX)
    },
    "decimal commas": made(TUM, ";", decimal=","),
    "comments at the ends": made(TUM, end="  # good"),
    "comments of MATLAB": made(TUM, header="% a trajectory"),
    "a trailing comma": made(TUM, ",", end=","),
    "TUM's header": made(TUM, header="# timestamp tx ty tz qx qy qz qw"),
    "a header without #": made(TUM, header="timestamp tx ty tz qx qy qz qw"),
    "a header of pandas": made(TUM, ",", "timestamp,x,y,z,qx,qy,qz,qw"),
    "quotes": made(TUM, ",", '"time","x","y","z","qx","qy","qz","qw"'),
    "a header above others": made(f"t_s {W}", header="# t x y z qw qx qy qz\n# of a run\n"),
    "quoted numbers": made("quoted_t x y z", '","', end='"', holds="t_s x y z"),
    "capitals": made(f"t_s {W}", ",", "TimeStamp,posX,posY,posZ,rotW,rotX,rotY,rotZ"),
    "w first by a header": made(f"t_s {W}", header="# t px py pz qw qx qy qz"),
    "another order": made("qw qx qy qz x y z t_s", header="qw qx qy qz x y z time"),
    "OpenVINS": made(f"{TUM} - - - -", header="# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12"),
    "20 columns": made(TUM + 12 * " -"),
    "29 columns": made(TUM + 21 * " -"),
    "12 columns": made(TUM + 4 * " -"),
    "MCD": made(f"n {TUM}", ",", "num,t,x,y,z,qx,qy,qz,qw", holds=TUM),
    "Newer College": made(f"whole rest_ns {Q}", ",", "#sec,nsec,x,y,z,qx,qy,qz,qw", holds=TUM),
    "VSLAM-LAB": made(NS, ",", "ts (ns),tx (m),ty (m),tz (m),qx,qy,qz,qw"),
    "EuRoC": made(f"t_ns {W} - - - -", ",", EUROC),
    "EuRoC's leica0": made("t_ns x y z", ",", EUROC[: EUROC.index(", q_RS")]),
    "rostopic": made(f"- n t_ns word {Q}", ",", ROSTOPIC, holds=TUM),
    "a text with blanks": made(f"label {TUM}", ",", "run,t,x,y,z,qx,qy,qz,qw", holds=TUM),
    "numbers of frames": made(f"n {Q}", header="# id x y z qx qy qz qw"),
    "KITTI-360": made(f"n {MATRIX}"),
    "KITTI-360, four rows": made(f"n {MATRIX} r41 r42 r43 r44"),
    "four rows": made(f"{MATRIX} r41 r42 r43 r44"),
    "stamps and matrices": made(f"t_s {MATRIX}"),
    "Euler angles": made("t_s x y z - - -", ",", "t,x,y,z,roll,pitch,yaw"),
    "velocities first": made("t_s - - - x y z", header="t v_x v_y v_z p_x p_y p_z"),
    "milliseconds": made(f"t_ms {Q}"),
    "microseconds": made(f"t_us {Q}"),
    "nanoseconds": made(NS),
    "milliseconds by a header": made(f"t_ms {Q}", ",", "time_ms,x,y,z,qx,qy,qz,qw"),
    "nanoseconds by a header": made(f"t_ns {Q}", ",", "timestampNs,x,y,z,qx,qy,qz,qw"),
    "microseconds by a header": made(f"t_us {Q}", ",", "Elapsed [µs],x,y,z,qx,qy,qz,qw"),
    **{
        f"millimetres: {header}": made("minutes x_mm y_mm z_mm", sign, header, holds="t_s x y z")
        for header, sign in (
            ("time [min],x [mm],y [mm],z [mm]", ","),
            ("# time_min tx_mm ty_mm tz_mm", " "),
            ('"time (min)","Position X (mm)","Position Y (mm)","Position Z (mm)"', ","),
            ("Time,TX,TY,TZ\nmin,mm,mm,mm", ","),
            ("# t,x,y,z\n# [min],[mm],[mm],[mm]", ","),
            ("# t x y z\n# [min] [mm] [mm] [mm]", " "),
        )
    },
    "millimetres by name": made("t_s x_mm y_mm z_mm", named="t x_mm y_mm z_mm", holds="t_s x y z"),
    "a clock before a duration": made(
        f"t_ms - {Q}", ",", "timeMs,track_ms,x,y,z,qx,qy,qz,qw", holds=f"t_ms {Q}"
    ),
    "ticks": made(f"t_ticks {Q}"),
    **{
        f"ticks by a header: {name}": made(f"t_ticks {Q}", ",", f"{name},x,y,z,qx,qy,qz,qw")
        for name in ("Ticks", "time [100 ns]", "timestamp_100ns")
    },
    "days and inches": made(
        "days x_inch y_inch z_inch",
        ",",
        "time (days),x_inches,y (inch),z [inches]",
        holds="t_s x y z",
    ),
    "separators at the ends": made(TUM, ";", "t;x;y;z;qx;qy;qz;qw;", end=";"),
    "a unit for a clock": made(f"t_us {Q}", ",", "unix_us,x,y,z,qx,qy,qz,qw"),
    "a word before the header": made(f"t_s {W}", header="# Format: time x y z qw qx qy qz"),
    "degrees are no vector": made("t_s x y z - - -", ",", "t,x[m],y[m],z[m],rx[deg],ry[°],rz_deg"),
    "frames of OKVIS": made(
        f"t_ns {Q} -",
        ",",
        ",".join(["t", *(f"p_WS_W_{a}" for a in "xyz"), *(f"q_WS_{a}" for a in "xyzw"), "b_a_x"]),
        holds=TUM,
    ),
    "rotations": made(NS, ",", "ts,tx,ty,tz,rx,ry,rz,rw", holds=TUM),
    "locations": made("t_s x y z - - -", ",", "t,loc_x,loc_y,loc_z,pitch,yaw,roll"),
    "orientations": made(f"t_s {W}", ",", "t,x,y,z,ow,ox,oy,oz"),
    "w first by name": made(f"t_s {W}", named="t x y z qw qx qy qz"),
    "names with commas": made(f"t_s {W}", named="t,x,y,z,qw,qx,qy,qz"),
    "the end is left out": made(f"{TUM} - word", named="t x y z qx qy qz qw"),
    "skipped columns": made(f"word {TUM}", named="- t x y z qx qy qz qw"),
    "names above a header": made(TUM, ",", "t,a,b,c,d,e,f,g", named="t x y z qx qy qz qw"),
    "the unit by name": made(f"t_us {Q}", named="t_us x y z qx qy qz qw"),
    "two units": made(f"whole rest_ns {Q}", named="t_s t_ns x y z qx qy qz qw", holds=TUM),
    "9 columns": made(f"n {TUM}", named="n t x y z qx qy qz qw", holds=TUM),
    "a stamp, a matrix and more": made(f"t_s {MATRIX} - -", named=f"t {MATRIX}"),
    "RealEstate10K": made(
        f"t_us - - - - - - {MATRIX}", header="https://a.b/?v=1", named=f"t {'- ' * 6}{MATRIX}"
    ),
    "GeoSLAM": made(f"{W} - n word", named="x y z qw qx qy qz - n"),
    "only positions by name": made(TUM, named="t x y z", holds="t_s x y z"),
}


@pytest.mark.parametrize(("text", "named", "holds"), READ.values(), ids=READ)
@pytest.mark.filterwarnings("ignore::alignscores.io.TrajectoryWarning")
def test_tables_are_read_whatever_their_layout(write, text, named, holds):
    keys, poses = read_tum(write(text), columns=named)
    np.testing.assert_allclose(poses[:, :3, 3], POSITIONS, rtol=0, atol=1e-8)
    rotations = ROTATIONS if "q" in holds or "r1" in holds else np.full((N, 3, 3), np.nan)
    np.testing.assert_allclose(poses[:, :3, :3], rotations, rtol=0, atol=1e-7)
    stamped, numbered = "t_" in holds, "n " in f"{holds} "
    expected = STAMPS if stamped else VALUES["n"] if numbered else np.arange(N)
    assert keys.dtype.kind == ("f" if stamped else "i")
    np.testing.assert_allclose(keys, expected, rtol=0, atol=1e-6)


NAME_THEM = "name them, as in --columns 't x y z qx qy qz qw'"


@pytest.mark.parametrize(
    ("text", "named", "reason"),
    [
        *[(made(" ".join("-" * n))[0], None, f"has {n} columns, .*{NAME_THEM}") for n in (2, 5, 6)],
        *[(made(" ".join("-" * n))[0], None, f"has {n} columns, .*{NAME_THEM}") for n in (7, 10)],
        *[(made(" ".join("-" * n))[0], None, f"has {n} columns, .*{NAME_THEM}") for n in (12, 16)],
        ("1\n", None, "has 1 column, whose meaning is unknown"),
        (made("t_s x y z", ",", "time,a,b,c")[0], None, f"names no x, y, z .*; {NAME_THEM}"),
        (made("t_s x y z", ",", "time,lat,lon,alt")[0], None, "has latitudes; convert them"),
        (
            made("t_s x y z", " ", "# time lat lon alt")[0],
            None,
            "has latitudes; convert them",
        ),
        *[
            (made("t_s x y -", " ", header)[0], None, "names no x, y, z .* a heading as a quat")
            for header in ("t x y yaw", "# t x y theta")
        ],
        (made("t_s x y", " ", "# t x y")[0], None, "names no x, y, z .*; write z, too"),
        ("t x y z n\n0 1 2 3\n", None, f"names 5 columns, its first row has 4; {NAME_THEM}"),
        ("a text\nof words\n", None, "has no line of numbers"),
        ("1 2 3 4\n1 2 3\n", None, "line 2: has 3 columns, the first row 4"),
        ("1 2 3 4\n1 2 x 4\n", None, "line 2: 'x' is not a number; --columns names the columns"),
        ("0,5 1,5 2,5 3,5\n", None, f"has 5 columns, .*{NAME_THEM}"),  # decimal commas
        ("t;x;y;z\n0,1;2;3;4\n0,2;1.050;3;4\n", None, "line 3: has , and . in the numbers of one"),
        ("1.5;2;3;4\n2.5;2;1,050;4\n", None, "line 2: has , and . in the numbers of one table"),
        ("x 2 3 4\n", None, f"line 1: has 4 columns, .*{NAME_THEM}"),
        ("1 2 3 4\n", "t x y z qx qy qz qw", "has 4 columns, not the 8 of 't x y z"),
        ("nan 2 3 4\n", None, "line 1: the time stamp is not finite"),
        (
            made(f"{MATRIX} r11 - - -")[0],
            None,
            "line 1: the last row of the matrix must be",
        ),
    ],
)
def test_unknown_tables_are_refused_in_one_sentence(write, text, named, reason):
    with pytest.raises(FileError, match=f"est.txt.*{reason}") as caught:
        read_tum(write(text), columns=named)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ("t x y z qx qy qz", "x, y and z, and all of a rotation or none, each once"),
        ("t x y x", "x, y and z, and all"),
        ("t qx qy qz qw", "x, y and z"),
        ("t x y z foo", "unknown column 'foo'; use t "),
    ],
)
def test_impossible_columns_are_refused(write, columns, reason):
    with pytest.raises(ValueError, match=reason):
        read_tum(write(made(f"{TUM} -")[0]), columns=columns)


def test_fields_may_be_empty(write):
    _, poses = read_tum(
        write(made(TUM, ",")[0] + "1800000000,,,,,,,\n1800000001,,,,null,NA,nan,\n")
    )
    assert np.isfinite(poses[:, 0, 3]).tolist() == [True] * N + [False] * 2


def test_rows_of_separators_are_blank_where_poses_have_keys(write):
    """Excel writes them at the end. Without keys they count: a pose was lost there."""
    lines = made(TUM, ",", "t,x,y,z,qx,qy,qz,qw")[0].splitlines()
    path = write([*lines[:3], ",,,,,,,", *lines[3:], ",,,,,,,", " , , ", ""])
    np.testing.assert_allclose(read_tum(path).keys, STAMPS)
    names = ["image,x,y,z", *(f"{n}.png,1,2,3" for n in range(N)), ",,,"]
    assert read_names(write(names)).keys.tolist() == [f"{n}.png" for n in range(N)]
    lines = made(MATRIX, ",")[0].splitlines()
    positions = read_kitti(write([lines[0], "," * 11, *lines[1:]])).positions
    assert np.isnan(positions[:, 0]).tolist() == [False, True, *[False] * (N - 1)]


@pytest.mark.filterwarnings("ignore::alignscores.io.TrajectoryWarning")
def test_texts_between_tabs_may_hold_blanks_and_other_separators(write):
    header = "VehicleName\tTimeStamp\tPOS_X\tPOS_Y\tPOS_Z\tImageFile"
    rows = made("t_ms x y z", "\t")[0].splitlines()
    path = write([header, *(f"Drone 1\t{row}\ta.png;b 2.png" for row in rows)])
    keys, poses = read_tum(path)
    np.testing.assert_allclose(keys, STAMPS)
    np.testing.assert_allclose(poses[:, :3, 3], POSITIONS, atol=1e-8)


def test_the_note_on_a_header_has_whole_names(write):
    long = "of_the_robot_in_the_warehouse"
    names = [f"field.{long}.pose.position.{axis}" for axis in "xyz"]
    names += [f"field.{long}.pose.orientation.{axis}" for axis in "xyzw"]
    text = made(f"- {TUM} -", ",", ",".join(["seq", "%time", *names, "speed"]))[0]
    with pytest.warns(match=r"orientation\.[xyz] \.\.\.\)"):
        read_tum(write(text))


def test_euroc_has_w_first_where_nothing_names_it(write, recwarn):
    for text in (made(f"t_ns {W} - -", ",")[0], made(f"t_ns {W}", ",", end=",")[0], made(NS)[0]):
        np.testing.assert_allclose(read_euroc(write(text)).poses[:, :3, :3], ROTATIONS, atol=1e-7)
    assert not recwarn.list  # nanoseconds and more columns are usual there


def test_kitti_has_no_stamps(write):
    with pytest.raises(FileError, match="has time stamps, unlike the kitti format; give tum"):
        read_kitti(write(made(TUM)[0]))


@pytest.mark.parametrize(
    ("text", "format_name"),
    [
        *[(made(columns)[0], "kitti") for columns in (MATRIX, f"{MATRIX} r41 r42 r43 r44")],
        *[(made(f"t_ns {W} -", ",")[0], "euroc"), (made(f"t_ns {W}", ",", EUROC)[0], "euroc")],
        *[(made(columns)[0], "tum") for columns in (TUM, NS, "t_s x y z", Q, f"n {MATRIX}")],
        *[(READ[name][0], "tum") for name in ("MCD", "VSLAM-LAB", "EuRoC's leica0", "rostopic")],
        *[("{", "nerf"), ("[\n{", "nerf"), ("\n {", "nerf")],
    ],
)
def test_the_format_of_a_text_is_recognised(write, text, format_name):
    assert recognise(str(write(text))) == format_name
