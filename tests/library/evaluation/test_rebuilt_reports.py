"""Public reports, rebuilt with our own path: scores are right, or a message has a working remedy.

`test_reports.py` has the same reports with other files, where these are present. The right scores
are those of the same poses without the fault, in memory.
"""

import json
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from alignscores import compare, evaluate
from alignscores.io import Trajectory, inverse_poses
from tests.files import write_model

N, START = 400, 1.7e9
SECONDS = np.arange(N) / 10


def path_of(seconds):
    """Return the poses (n, 4, 4) of a hand-held camera that neither stops nor repeats its path."""
    t = np.asarray(seconds)
    poses = np.tile(np.eye(4), (len(t), 1, 1))
    poses[:, :3, 3] = 3 * np.transpose([np.cos(t / 3), np.sin(t / 2.1), np.sin(t / 1.3) / 2])
    turns = 0.6 * np.transpose([np.sin(0.7 * t), np.cos(0.45 * t) + np.sin(1.1 * t), np.sin(t / 4)])
    poses[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return poses


def with_errors(poses, seed=0):
    """Return poses as estimated by a monocular system: noise, another frame, another scale."""
    rng = np.random.default_rng(seed)
    noisy, frame = poses.copy(), np.eye(4)
    turns = Rotation.from_rotvec(rng.normal(0, 0.015, (len(poses), 3)))
    noisy[:, :3, :3] = turns.as_matrix() @ poses[:, :3, :3]
    noisy[:, :3, 3] = 0.5 * (poses[:, :3, 3] + rng.normal(0, 0.03, (len(poses), 3)))
    frame[:3, :3], frame[:3, 3] = Rotation.from_rotvec([0.3, -0.5, 1.2]).as_matrix(), [1, -2, 0.5]
    return frame @ noisy


TRUTH = path_of(SECONDS)
ESTIMATE = with_errors(TRUTH)
STAMPS, NUMBERS = START + SECONDS, np.arange(N)
NAMES = np.array([f"IMG_{number:04}.jpg" for number in range(N)])


def quaternions(poses, w_first=False):
    return Rotation.from_matrix(poses[:, :3, :3]).as_quat(scalar_first=w_first)


def rows(keys, poses, w_first=False):
    return np.column_stack([keys, poses[:, :3, 3], quaternions(poses, w_first)])


def save(name, *columns, header="", by=" "):
    """Write a table; return its name."""
    np.savetxt(name, np.column_stack(columns), fmt="%.9f", delimiter=by, header=header, comments="")
    return name


def tum(name, poses, keys=STAMPS):
    return save(name, rows(keys, poses))


def kitti(name, poses):
    return save(name, poses[:, :3].reshape(-1, 12))


def in_memory(keys=STAMPS, rows=slice(None), poses=ESTIMATE, reference=TRUTH):
    """Return the evaluation of poses without a fault; the estimate has only these rows."""
    return evaluate(Trajectory(keys, reference), Trajectory(keys[rows], poses[rows]))


@dataclass
class Report:
    """Files and settings of a report, and what must come of them."""

    files: tuple
    says: str = ""  # pattern of the notes, or of the refusal
    settings: dict = field(default_factory=dict)
    remedy: dict | None = None  # settings for the right scores, as the message says; None: the same
    mended: tuple | None = None  # files for the right scores, as the message says; None: the same
    refused: bool = False
    right: object = None  # evaluation or scores that are right; None: `in_memory()`


def rotation_vectors():
    """ARKitScenes#37: t, rotation vector, translation, world-to-camera."""
    to_camera = inverse_poses(TRUTH)
    vectors = Rotation.from_matrix(to_camera[:, :3, :3]).as_rotvec()
    reference = save("lowres_wide.traj", STAMPS, vectors, to_camera[:, :3, 3])
    files, columns = (reference, tum("est.txt", ESTIMATE)), {"ref_columns": "t rx ry rz x y z"}
    yield Report(files, r"rotation vectors, 't rx ry rz x y z'", refused=True)
    inverted = columns | {"ref_invert": True}
    yield Report(files, "world-to-camera .* --ref_invert corrects it", columns, remedy=inverted)


def numbered_frames():
    """kitti360Scripts#141: the reference lacks frames; line i of a KITTI file is frame i."""
    present = np.setdiff1d(NUMBERS, [*range(10), *range(150, 191)])
    reference = save("poses.txt", present, TRUTH[present, :3].reshape(-1, 12))
    right = evaluate(Trajectory(present, TRUTH[present]), Trajectory(present, ESTIMATE[present]))
    files = reference, kitti("est.txt", ESTIMATE)
    yield Report(files, "51 of 400 frames are not in the reference; left out", right=right)


def whole_seconds():
    """evo#331: stamps without their fraction, in either file."""
    reference = tum("gt.txt", TRUTH)
    whole = tum("whole.txt", ESTIMATE, np.floor(STAMPS))
    says = "360 of 400 poses have the time stamp of another one"
    mended = reference, tum("est.txt", ESTIMATE)
    yield Report((reference, whole), says, refused=True, mended=mended)
    yield Report((tum("floor.txt", TRUTH, np.floor(STAMPS)), mended[1]), says, refused=True)


def several_runs():
    """evo#260: the runs of a night in one file."""
    other = with_errors(TRUTH, seed=1)
    both = save("both.txt", np.vstack([rows(STAMPS, ESTIMATE), rows(STAMPS, other)]))
    reference = tum("gt.txt", TRUTH)
    says = "line 401: the time stamps jump back by 39.9 s: .* several runs; write a file for each"
    yield Report((reference, both), says, refused=True, mended=(reference, tum("1.txt", ESTIMATE)))


def fewer_rows():
    """evo#204: 60 keyframes of 600 frames, in KITTI's format."""
    reference, keyframes = kitti("gt.txt", TRUTH), kitti("keyframes.txt", ESTIMATE[::4])
    says = r"400 poses, the estimate 100.*\(write the number of its frame before each pose"
    numbered = save("n.txt", NUMBERS[::4], ESTIMATE[::4, :3].reshape(-1, 12))
    right = in_memory(NUMBERS, slice(None, None, 4))
    for mended in (numbered, kitti("nan.txt", np.where(NUMBERS % 4, np.nan, ESTIMATE.T).T)):
        for settings in ({}, {"missing": "ignore"}):
            yield Report((reference, keyframes), says, settings, refused=True)
        yield Report((reference, mended), right=right)


def body_frame():
    """open_vins#462: a motion capture's body frame, about an odd axis."""
    frame = np.eye(4)
    frame[:3, :3] = Rotation.from_rotvec([0.03, 0.06, -3.1]).as_matrix()
    files = tum("gt.txt", TRUTH), tum("est.txt", ESTIMATE @ frame)
    says = r"rotated against that of gt.txt, 17\d.\d deg about .*--body_rotation auto removes it"
    yield Report(files, says, remedy={"body_rotation": "auto"})


def results_of_hloc():
    """Hierarchical-Localization#109: names with folders, world-to-camera, w first."""
    write_model(Path("gt"), NAMES, TRUTH)
    to_camera, present = inverse_poses(ESTIMATE), slice(0, N, 2)
    numbers = np.column_stack([quaternions(to_camera, w_first=True), to_camera[:, :3, 3]])
    lines = [
        " ".join([f"query/night/{name}", *map(repr, row)])
        for name, row in zip(NAMES[present], numbers[present].tolist(), strict=True)
    ]
    Path("results.txt").write_text("\n".join(lines))
    says = "matched by the end of their path"
    yield Report(("gt", "results.txt"), says, right=in_memory(NAMES, present))


def sparse_reference():
    """S3E#2, UrbanNavDataset#56: 1 Hz, by GNSS or not; evo's ATE is that at the common stamps."""
    metric = ESTIMATE.copy()
    metric[:, :3, 3] *= 2
    common = slice(0, N, 10)
    gt, est = (poses[common, :3, 3] for poses in (TRUTH, metric))
    _, root = Rotation.align_vectors(gt - gt.mean(axis=0), est - est.mean(axis=0))
    ate = root / np.sqrt(len(gt))
    upright = TRUTH.copy()
    upright[:, :3, :3] = np.eye(3)
    for poses, says in ((upright, "all rotations of the reference are the same"), (TRUTH, "")):
        files = tum("gt.txt", poses[common], STAMPS[common]), tum("est.txt", metric)
        says = f"(?s)(?=.*{says})(?=.*too sparse to be interpolated)"
        yield Report(files, says, {"alignment": "rigid"}, right=(None, None, ate))


def left_handed_frame():
    """colmap#3226: Unity's frame."""
    mirror = np.diag([1.0, -1, 1, 1])
    reference, estimate = tum("gt.txt", TRUTH), tum("est.txt", ESTIMATE)
    says = "mirror images: the reference, or the estimate, is left-handed.*with y negated in its"
    files = tum("unity.txt", mirror @ TRUTH @ mirror), estimate
    yield Report(files, says, mended=(reference, estimate))


def motions():
    """monodepth2#143: rows from frame to frame, in one or both of the files."""
    files = kitti("gt.txt", TRUTH), kitti("est.txt", ESTIMATE)
    right = in_memory(NUMBERS)
    from_to = [inverse_poses(poses[:-1]) @ poses[1:] for poses in (TRUTH, ESTIMATE)]
    steps = [kitti(f"{number}.txt", poses) for number, poses in enumerate(from_to)]
    with_first = kitti("n.txt", np.concatenate([ESTIMATE[:1], from_to[1]]))
    says = "seem to be motions from frame to frame.* write their product, pose by pose"
    yield Report((files[0], steps[1]), says, refused=True, mended=files, right=right)
    yield Report((files[0], with_first), says, mended=files, right=right)
    yield Report(tuple(steps), f"both .* {says}", mended=files, right=right)


def recording_of_airsim():
    """AirSim#3091: names between the numbers, w first by the header, milliseconds."""
    header = "VehicleName\tTimeStamp\tPOS_X\tPOS_Y\tPOS_Z\tQ_W\tQ_X\tQ_Y\tQ_Z\tImageFile"
    numbers = rows(STAMPS, TRUTH, w_first=True).tolist()
    lines = [
        "\t".join(["Drone1", f"{1000 * stamp:.0f}", *map(repr, pose), "img.png"])
        for stamp, *pose in numbers
    ]
    Path("airsim_rec.txt").write_text("\n".join([header, *lines]))
    yield Report(("airsim_rec.txt", tum("est.txt", ESTIMATE)), "time stamps in ms")


def keys_of_a_factor_graph():
    """cslam_experiments#15: GTSAM's keys in place of stamps."""
    reference, estimate = tum("gt.txt", TRUTH), tum("est.txt", ESTIMATE)
    poses = [line.partition(" ")[2] for line in Path(estimate).read_text().splitlines()]
    lines = [f"{18295873486192640 + row} {pose}" for row, pose in enumerate(poses)]
    Path("keys.txt").write_text("\n".join(lines))
    says = "the time stamps count by one.*write the time of each pose.*no --t_offset can help"
    for settings in ({}, {"t_offset": "auto"}):
        files = reference, "keys.txt"
        yield Report(files, says, settings, refused=True, mended=(reference, estimate))


def pose_graph():
    """hdl_graph_slam#122: only vertices are poses."""
    lines = [
        f"VERTEX_SE3:QUAT {int(key)} {' '.join(map(repr, pose))}"
        for key, *pose in rows(NUMBERS, ESTIMATE).tolist()
    ]
    edge = f"EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 {' '.join(['1'] * 21)}"
    Path("graph.g2o").write_text("\n".join([*lines, edge]))
    yield Report((kitti("gt.txt", TRUTH), "graph.g2o"), right=in_memory(NUMBERS))
    says = "the reference has time stamps in seconds, the estimate frame numbers"
    yield Report((tum("stamped.txt", TRUTH), "graph.g2o"), says, refused=True)


def matrices_of_scannet():
    """HI-SLAM2#32: unpadded names, and -inf where there is no pose."""
    present = NUMBERS % 10 != 3
    Path("pose").mkdir()
    for number, pose in enumerate(np.where(present, TRUTH.T, -np.inf).T):
        np.savetxt(f"pose/{number}.txt", pose)
    poses = np.where(present, TRUTH.T, np.nan).T
    right = evaluate(Trajectory(NUMBERS, poses), Trajectory(NUMBERS, ESTIMATE))
    files = "pose", save("est.txt", rows(NUMBERS, ESTIMATE))
    yield Report(files, "no pose for 10.0% of the cameras; nothing is expected there", right=right)


def opengl_axes():
    """SEGS-SLAM#17."""
    files = kitti("gt.txt", TRUTH), kitti("est.txt", ESTIMATE @ np.diag([1.0, -1, -1, 1]))
    says = "180 deg about x, as OpenGL's camera axes to OpenCV's.*--body_rotation auto removes it"
    yield Report(files, says, remedy={"body_rotation": "auto"}, right=in_memory(NUMBERS))


def reconstructions_of_opensfm():
    """OpenSfM#1032: two reconstructions, world-to-camera rotation vectors."""
    write_model(Path("gt"), NAMES, TRUTH)
    to_camera = inverse_poses(ESTIMATE)
    vectors = Rotation.from_matrix(to_camera[:, :3, :3]).as_rotvec()
    shots = [
        (name, {"rotation": vector.tolist(), "translation": pose[:3, 3].tolist()})
        for name, vector, pose in zip(NAMES.tolist(), vectors, to_camera, strict=True)
    ]
    models = [{"cameras": {}, "shots": dict(part)} for part in (shots[:300], shots[300:])]
    Path("reconstruction.json").write_text(json.dumps(models))
    right = in_memory(NAMES, slice(300))
    yield Report(("gt", "reconstruction.json"), "it has 2 models; scored is 0", right=right)


def images_in_another_order():
    """InstantSplat#3: by their names, whatever their numbers."""
    order = np.random.default_rng(0).permutation(N)
    write_model(Path("gt"), NAMES, TRUTH)
    write_model(Path("est"), NAMES[order], ESTIMATE[order])
    yield Report(("gt", "est"), right=in_memory(NAMES))


def turned_line():
    """evo#593: nine positions on a line, turned by 180 degrees, but not the rotations."""
    reference = TRUTH[:9].copy()
    reference[:, :3, 3] = 0
    reference[:, 0, 3] = np.arange(9) + np.random.default_rng(0).normal(0, 0.02, 9)
    turned = reference.copy()
    turned[:, :3, 3] *= -1
    files = tum("gt.txt", reference, STAMPS[:9]), tum("est.txt", turned, STAMPS[:9])
    says = "alignments 180 deg apart; TAS and RAS align separately and do not show it: coordinate"
    yield Report(files, says, right=())


def two_clocks():
    """projectaria_tools#8: since the start of the device, and since 1970."""
    header = "uid,tracking_timestamp_us,utc_timestamp_ns,tx,ty,tz,qx,qy,qz,qw"
    clocks = 1e6 * (2051 + SECONDS), 1e9 * STAMPS
    reference = save(
        "loop.csv", NUMBERS, *clocks, rows(STAMPS, TRUTH)[:, 1:], header=header, by=","
    )
    files = reference, tum("est.txt", ESTIMATE, 2051 + SECONDS)
    choice = "- t_us - x y z qx qy qz qw"
    says = f"its header names 2 clocks; choose one by --ref_columns '{choice}' or"
    yield Report(files, says, remedy={"ref_columns": choice}, refused=True)


def w_first():
    """SVIn#26: without a header."""
    files = save("gt.txt", rows(STAMPS, TRUTH, w_first=True)), tum("est.txt", ESTIMATE)
    columns = "t x y z qw qx qy qz"
    says = f"have w at the wrong end.*name their order with --ref_columns '{columns}'"
    yield Report(files, says, remedy={"ref_columns": columns})


def no_common_key():
    """rpg_trajectory_evaluation#43: numbers, positions and Euler angles against stamps."""
    euler = Rotation.from_matrix(TRUTH[:, :3, :3]).as_euler("xyz")
    files = save("gt.txt", NUMBERS, TRUTH[:, :3, 3], euler), tum("est.txt", ESTIMATE)
    yield Report(files, "7 columns, whose meaning is unknown; name them", refused=True)
    says = "the reference has frame numbers, the estimate time stamps in seconds"
    yield Report(files, says, {"ref_columns": "n x y z - - -"}, refused=True)


def world_to_camera():
    """vggt#229: arrays, of the estimate, of the reference, or of both."""
    for inverted in ("est",), ("ref",), ("ref", "est"):
        for name, poses in (("ref", TRUTH), ("est", ESTIMATE)):
            np.savez(f"{name}.npz", poses=inverse_poses(poses) if name in inverted else poses)
        options = " ".join(f"--{name}_invert" for name in inverted)
        remedy = {"ref_invert": "ref" in inverted, "invert": "est" in inverted}
        says, right = f"world-to-camera .*; {options} corrects it", in_memory(NUMBERS)
        yield Report(("ref.npz", "est.npz"), says, remedy=remedy, right=right)


def ninth_column():
    """rtabmap#1096: an id behind the pose, with a header or without."""
    reference, table = tum("gt.txt", TRUTH), (rows(STAMPS, ESTIMATE), NUMBERS)
    header = "#timestamp x y z qx qy qz qw id"
    yield Report((reference, save("header.txt", *table, header=header)))
    yield Report((reference, save("none.txt", *table)), "1 of 9 columns ignored")


def one_pose_throughout():
    """evo#240."""
    still = np.tile(ESTIMATE[:1], (N, 1, 1))
    files = tum("gt.txt", TRUTH), tum("est.txt", still)
    for settings in ({}, {"alignment": "rigid"}):
        yield Report(files, "all poses are identical; none counts", settings, right=(0, 0, None))


def clocks():
    """ICCV2023_SLAM_Challenge#3, evo#346, evo#633: far apart, both from zero, matched anyhow."""
    auto = {"t_offset": "auto"}
    files = tum("gt.txt", TRUTH), tum("est.txt", ESTIMATE, STAMPS + 90569539.49)
    says = r"offset of -90569539.4(8[5-9]|9\d*).*--t_offset auto adds it"
    yield Report(files, says, remedy=auto, refused=True)
    says = "t_max_diff is in seconds, and 1e.25 s are longer than the recording"
    yield Report(files, says, {"t_max_diff": 1e25}, refused=True)
    files = tum("a.txt", TRUTH, SECONDS), tum("b.txt", ESTIMATE[14:], SECONDS[:-14])
    says = "its clock is off.*offset of 1.(39[5-9]|40).*--t_offset auto adds it"
    yield Report(files, says, remedy=auto, right=in_memory(SECONDS, slice(14, None)))


def units_of_time():
    """evo#329: milliseconds and microseconds since the start, in both files or one."""
    seconds = SECONDS / 3  # frames at 30 Hz
    truth = path_of(seconds)
    estimate = with_errors(truth)
    right = evaluate(Trajectory(seconds, truth), Trajectory(seconds, estimate))
    in_s, in_ms, in_us = (
        (
            tum(f"gt_{unit}.txt", truth, seconds * unit),
            tum(f"est_{unit}.txt", estimate, seconds * unit),
        )
        for unit in (1, 1000, 1000000)
    )
    ms, us = (f"t_{unit} x y z qx qy qz qw" for unit in ("ms", "us"))
    both = f"seem to be ms in both.*--columns '{ms}' names the unit"
    yield Report(tuple(in_ms), both, remedy={"columns": ms}, right=right)
    both = f"seem to be us in both.*--columns '{us}' names the unit"
    yield Report(tuple(in_us), both, remedy={"columns": us}, right=right)
    one = f"only 1 of 400 poses.*seem to be ms in .*--est_columns '{ms}' names the unit"
    yield Report((in_s[0], in_ms[1]), one, remedy={"est_columns": ms}, refused=True, right=right)


def degrees():
    """evo#420: latitude, longitude and height without a header."""
    to_degrees = np.array([1 / 111320, 1 / 111320 / np.cos(np.radians(48.98)), 1])
    geodetic = np.array([48.98, 8.39, 112]) + TRUTH[:, [1, 0, 2], 3] * to_degrees
    files = save("gps.txt", STAMPS, geodetic), tum("est.txt", ESTIMATE)
    mended = save("enu.txt", STAMPS, TRUTH[:, :3, 3]), files[1]
    right = in_memory().tas, None, in_memory().ate
    says = "seems to have latitudes and longitudes.* convert them to east, north, up in metres"
    yield Report(files, says, refused=True, mended=mended, right=right)


def euler_angles():
    """rpg_trajectory_evaluation#43: roll, pitch, yaw and a confidence, where quaternions stand."""
    angles = Rotation.from_matrix(ESTIMATE[:, :3, :3]).as_euler("xyz")
    right = in_memory().tas, None, in_memory().ate
    says = "quaternion of length .* is not a rotation.*'t x y z' for only positions.*Euler angles"
    for name, values in (("radians.txt", angles), ("degrees.txt", np.degrees(angles))):
        estimate = save(name, STAMPS, ESTIMATE[:, :3, 3], values, np.full(N, 0.2))
        files, remedy = (tum("gt.txt", TRUTH), estimate), {"est_columns": "t x y z"}
        yield Report(files, says, remedy=remedy, refused=True, right=right)


def two_poses():
    """A merged table must not score the columns of the ground truth."""
    reference, pose = tum("gt.txt", TRUTH), ["x", "y", "z", "qx", "qy", "qz", "qw"]
    both = rows(STAMPS, TRUTH), rows(STAMPS, ESTIMATE)[:, 1:]
    for owners in (("gt", "est"), ("true_pos", "pos"), ("reference", "prediction")):
        header = ",".join(["timestamp", *(f"{owner}_{name}" for owner in owners for name in pose)])
        estimate = save("both.csv", *both, header=header, by=",")
        columns = "t - - - - - - - x y z qx qy qz qw"
        says, remedy = f"its header names 2 poses.*'{columns}'", {"est_columns": columns}
        yield Report((reference, estimate), says, remedy=remedy, refused=True)


def commas():
    """Eight columns without a header: TUM's order."""
    files = [
        save(f"{name}.csv", rows(STAMPS, poses), by=",")
        for name, poses in (("gt", TRUTH), ("est", ESTIMATE))
    ]
    yield Report(tuple(files))
    yield Report(tuple(files), settings={"format": "tum"})
    yield Report((tum("gt.txt", TRUTH), files[1]))


CASES = [
    rotation_vectors,
    numbered_frames,
    whole_seconds,
    several_runs,
    fewer_rows,
    body_frame,
    results_of_hloc,
    sparse_reference,
    left_handed_frame,
    motions,
    recording_of_airsim,
    keys_of_a_factor_graph,
    pose_graph,
    matrices_of_scannet,
    opengl_axes,
    reconstructions_of_opensfm,
    images_in_another_order,
    turned_line,
    two_clocks,
    w_first,
    no_common_key,
    world_to_camera,
    ninth_column,
    one_pose_throughout,
    clocks,
    units_of_time,
    degrees,
    euler_angles,
    two_poses,
    commas,
]


def options_of(settings):
    """Return settings as they stand on the command line."""
    options = []
    for name, value in settings.items():
        if name != "format" and value is not False:
            options += [f"--{name}"] if value is True else [f"--{name}={value}"]
    return options


def same_scores(actual, right):
    """Compare TAS, RAS and ATE, but for those that are None."""
    for value, expected in zip(actual, right, strict=False):
        if expected is not None:
            assert value == pytest.approx(expected, abs=0.005)


def scores(evaluation):
    return evaluation.tas, evaluation.ras, evaluation.ate


def by_function(report):
    """Return the reason of a refusal, or the notes, of `evaluate`."""
    if report.refused:
        with pytest.raises(ValueError, match=r"\w") as caught:
            evaluate(*report.files, **report.settings)
        return str(caught.value)
    return "\n".join(map(str, evaluate(*report.files, **report.settings).notes))


def by_comparison(report):
    """Return the reason of a refusal, or the notes, of `compare`."""
    reference, estimate = report.files
    try:
        compared = compare(reference, [estimate], **report.settings)
    except ValueError as error:
        assert report.refused
        return str(error)
    failed = compared.runs["status"].tolist() == ["failed"]
    assert failed == (report.refused or "identical" in report.says)
    return "\n".join([*compared.notes, *compared.runs["error"]])


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
@pytest.mark.filterwarnings("ignore::alignscores.io.TrajectoryWarning")
def test_the_command_and_both_functions_handle_a_report(case, command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for report in case():
        files = [report.settings.get("format"), *report.files]
        code, _, err = command(*filter(None, files), *options_of(report.settings), "--json")
        assert code == int(report.refused)
        for message in (err, by_function(report), by_comparison(report)):
            assert re.search(report.says, message)
        if report.refused and report.remedy is report.mended is None:
            continue
        settings = report.remedy if report.remedy is not None else report.settings
        files = report.mended or report.files
        evaluation = evaluate(*files, **settings)
        if promise := re.search(r"(\d\.\d+) corrected\)", err):
            assert float(promise.group(1)) == pytest.approx(evaluation.pas, abs=0.002)
        right = in_memory() if report.right is None else report.right
        right = right if isinstance(right, tuple) else scores(right)
        same_scores(scores(evaluation), right)
        row = compare(files[0], [files[1]], **settings).runs.iloc[0]
        same_scores(row[["TAS", "RAS", "ATE"]], right)
        code, out, _ = command(
            *filter(None, [settings.get("format"), *files]), *options_of(settings), "--json"
        )
        (printed,) = json.loads(out)["results"]
        same_scores([printed["TAS"], printed["RAS"], printed["ate"]], right)


def test_runs_of_one_pose_are_failures_of_their_system(command, tmp_path, monkeypatch):
    """Also where all quaternions are zero; empty files fail in the same way."""
    monkeypatch.chdir(tmp_path)
    Path("s").mkdir()
    tum("s/gt.txt", TRUTH)
    still = rows(STAMPS, np.tile(ESTIMATE[:1], (N, 1, 1)))
    zero = np.column_stack([rows(STAMPS, ESTIMATE)[:, :4], np.zeros((N, 4))])
    zero[:, 1:4] = zero[0, 1:4]
    for system, table in (("idle", still), ("zero", zero), ("empty", np.empty((0, 8)))):
        Path("s", system).mkdir()
        tum(f"s/{system}/0.txt", ESTIMATE)
        for run in (1, 2, 3):
            save(f"s/{system}/{run}.txt", table)
    patterns = "{sequence}/gt.txt", "{sequence}/{system}/{run}.txt"
    means = compare(*patterns).summary.query("sequence.isna()").set_index("system")["PAS"]
    assert means.tolist() == pytest.approx([in_memory().pas / 4] * 3, abs=0.001)
    code, _, err = command("compare", *patterns, "--fail_on", "PAS<0.5,failed>0")
    assert code == 3
    for system in means.index:
        assert f"{system}: PAS" in err
        assert f"{system}: failed 75% > 0%" in err


def test_a_frozen_pose_scores_no_more_than_a_gap(tmp_path, monkeypatch):
    """ORB_SLAM3#619: a pose repeats while the camera moves."""
    lost = slice(200, 280)
    frozen, present = ESTIMATE.copy(), np.delete(NUMBERS, lost)
    frozen[lost] = frozen[199]
    reference = Trajectory(STAMPS, TRUTH)
    noted = evaluate(reference, Trajectory(STAMPS, frozen))
    gap = evaluate(reference, Trajectory(STAMPS[present], ESTIMATE[present]))
    assert "tracking seems to have failed; such poses count as wrong" in str(noted.notes[0])
    assert noted.tas <= gap.tas
    assert noted.ras <= gap.ras
