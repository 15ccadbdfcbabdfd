"""Count how often the hints on mistakes in files are right: ``python -m benchmarks.hints``.

Random trajectories and estimates are written to files, without a mistake and with one. Only
mistakes that cost at least 0.03 of the score count, since a hint must raise the score clearly. A
mistake counts as named if the only hint states it, the file, and a score near that of the right
files, which the options in the hint must reach. A hint may list possibilities that fit equally
well.
"""

import argparse
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline, Slerp
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from alignscores import Evaluation, Trajectory, evaluate
from alignscores.arrays import Floats
from alignscores.evaluation.evaluation import Hint
from alignscores.io import FAILURES, inverse_poses

__all__ = ["main"]

MIN_COST = 0.03  # of a mistake
NEAR = 0.05  # between the corrected score and that of the files without a mistake
MIN_POSES = 20  # of an estimate
MIN_SCORE = 0.2  # of files without a mistake; estimates with a lower score are drawn again
REF, EST = "reference.txt", "estimate.txt"
OTHER_AXES = np.diag([1.0, -1, -1, 1]), np.eye(4)[[1, 2, 0, 3]], np.eye(4)[[2, 0, 1, 3]]
CAMERA_AXES = Rotation.from_matrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # of one that looks ahead
FRAMES = {  # of an estimate, by alignment
    "similarity": ["the same", "of the first pose", "yaw", "any"],
    "rigid": ["the same", "of the first pose", "yaw", "any"],
    "yaw": ["the same", "yaw"],
    "none": ["the same"],
}
OTHER_ALIGNMENTS = 0.3  # share of pairs
RealPairs = Sequence[tuple[Trajectory, Trajectory]]


@dataclass(frozen=True)
class Written:
    """A trajectory, and how it is written to a file."""

    path: Trajectory
    table: bool  # in TUM's format, otherwise in KITTI's
    per_second: float = 1.0  # units of its stamps in a second
    w_first: bool = False
    positions_only: bool = False

    def write(self, file: Path) -> None:
        """Write the file, with all digits."""
        stamps, poses = self.path
        if not self.table:
            np.savetxt(file, poses[:, :3].reshape(-1, 12), fmt="%.16g")
            return
        quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat(scalar_first=self.w_first)
        columns = [stamps * self.per_second, poses[:, :3, 3], quaternions]
        np.savetxt(file, np.column_stack(columns[: 2 if self.positions_only else 3]), fmt="%.16g")


@dataclass(frozen=True)
class Pair:
    """A reference, an estimate, the settings that score them, and the mistake in some files."""

    reference: Written
    estimate: Written
    settings: dict[str, Any] = field(default_factory=dict)
    mistake: str = ""
    files: tuple[str, ...] = ()


def make_path(rng: np.random.Generator, kind: str, seconds: float, rate: float) -> Trajectory:
    """Return the random path of a hand-held camera, a drone, a car, or around an object."""
    stamps = np.arange(int(seconds * rate)) / rate
    if kind == "car":
        fine = np.arange(0, seconds + 1, 0.02)
        heading = np.cumsum(_smooth(rng, fine, 3.0, 0.15)[:, 0]) * 0.02 * rng.uniform(0.5, 2)
        speed = np.maximum(8 + 5 * _smooth(rng, fine, 5.0, 1.0)[:, 0], 0)
        slope = 0.03 * _smooth(rng, fine, 4.0, 1.0)[:, 0]
        velocity = speed[:, None] * np.stack([np.cos(heading), np.sin(heading), slope], axis=1)
        positions = CubicSpline(fine, np.cumsum(velocity, axis=0) * 0.02)(stamps)
        shaking = np.radians(0.5) * _smooth(rng, stamps, 0.3, 1.0)
        turns = np.interp(stamps, fine, heading), -np.interp(stamps, fine, slope)
        body = Rotation.from_euler("ZY", np.stack(turns, axis=1)) * Rotation.from_rotvec(shaking)
        return Trajectory(stamps, _poses(body * CAMERA_AXES, positions))
    if kind == "around an object":
        angle = rng.uniform(0.3, 1.5) * 2 * np.pi * stamps / seconds
        radius = 2 + 0.3 * _smooth(rng, stamps, 5.0, 1.0)[:, 0]
        height = 0.7 + 0.4 * _smooth(rng, stamps, 5.0, 1.0)[:, 0]
        positions = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
        ahead = -positions / np.linalg.norm(positions, axis=1, keepdims=True)
        right = np.cross(ahead, [0.0, 0, 1])
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        axes = np.stack([right, np.cross(ahead, right), ahead], axis=-1)
        shaking = Rotation.from_rotvec(np.radians(2) * _smooth(rng, stamps, 0.7, 1.0))
        return Trajectory(stamps, _poses(Rotation.from_matrix(axes) * shaking, positions))
    step, tilt, knots = (0.3, 0.35, 1.0) if kind == "hand" else (2.0, 0.1, 2.0)
    times = np.arange(-2, seconds + 3 * knots, knots)
    positions = np.cumsum(step * rng.normal(size=(len(times), 3)) * [1, 1, 0.4], axis=0)
    yaw = np.cumsum(0.4 * rng.normal(size=len(times)))
    tilts = Rotation.from_rotvec(tilt * rng.normal(size=(len(times), 3)) * [1, 1, 0.1])
    rotations = RotationSpline(times, Rotation.from_euler("z", yaw[:, None]) * tilts)
    positions = CubicSpline(times, positions)(stamps)
    return Trajectory(stamps, _poses(rotations(stamps) * CAMERA_AXES, positions))


def _smooth(rng: np.random.Generator, stamps: Floats, knots: float, sigma: float) -> Floats:
    """Return smooth random curves (n, 3) through knots so many seconds apart."""
    times = np.arange(stamps[0] - 2 * knots, stamps[-1] + 3 * knots, knots)
    return np.asarray(CubicSpline(times, sigma * rng.normal(size=(len(times), 3)))(stamps))


def _poses(rotations: Rotation, positions: Floats) -> Floats:
    poses = np.tile(np.eye(4), (len(positions), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotations.as_matrix(), positions
    return poses


def estimate_of(rng: np.random.Generator, truth: Trajectory, stamps: Floats) -> Trajectory:
    """Return an estimate with accumulated or smooth errors, noise and outliers."""
    rotations = Slerp(truth.keys, Rotation.from_matrix(truth.poses[:, :3, :3]))(stamps)
    positions = CubicSpline(truth.keys, truth.poses[:, :3, 3])(stamps)
    n, step = len(stamps), _step(positions)
    poses = _poses(rotations, positions)
    if rng.random() < 0.6:  # the errors of motions add up
        motions = inverse_poses(poses[:-1]) @ poses[1:]
        seconds = np.diff(stamps)[:, None]
        turns = np.radians(rng.uniform(0.02, 0.5)) * np.sqrt(seconds) * rng.normal(size=(n - 1, 3))
        turns += np.radians(rng.uniform(0, 0.05)) * rng.normal(size=3) * seconds
        lengths = 1 + rng.uniform(0, 0.03) * _smooth(rng, stamps[1:], 10.0, 1.0)[:, :1]
        noise = rng.uniform(0.01, 0.1) * step * rng.normal(size=(n - 1, 3))
        motions[:, :3, :3] = motions[:, :3, :3] @ Rotation.from_rotvec(turns).as_matrix()
        motions[:, :3, 3] = motions[:, :3, 3] * lengths + noise
        for row, motion in enumerate(motions):
            poses[row + 1] = poses[row] @ motion
    else:
        poses[:, :3, 3] += rng.uniform(0.1, 1) * step * _smooth(rng, stamps, 2.0, 1.0)
    turns = np.radians(rng.uniform(0.05, 2)) * rng.normal(size=(n, 3))
    poses[:, :3, :3] = poses[:, :3, :3] @ Rotation.from_rotvec(turns).as_matrix()
    poses[:, :3, 3] += rng.uniform(0.02, 0.4) * step * rng.normal(size=(n, 3))
    outliers = rng.random(n) < rng.choice([0.0, 0.0, 0.05, 0.3])
    poses[outliers, :3, 3] += 20 * step * rng.normal(size=(outliers.sum(), 3))
    poses[outliers, :3, :3] = Rotation.random(outliers.sum(), random_state=rng).as_matrix()
    return Trajectory(stamps, poses)


def _step(positions: Floats) -> float:
    return float(np.median(np.linalg.norm(np.diff(positions, axis=0), axis=1)))


def estimated_stamps(rng: np.random.Generator, stamps: Floats) -> Floats:
    """Return the stamps of an estimate: fewer, without the ends, sometimes with a gap."""
    if rng.random() < 0.3:
        stamps = stamps[rng.random(len(stamps)) < rng.uniform(0.1, 0.5)]
    else:
        stamps = stamps[:: rng.integers(1, 4)]
    first, last = rng.uniform(0, 0.1), rng.uniform(0.9, 1)
    stamps = stamps[int(first * len(stamps)) : int(last * len(stamps))]
    if rng.random() < 0.3:
        start = int(rng.uniform(0.1, 0.7) * len(stamps))
        stamps = np.delete(stamps, np.s_[start : start + int(0.15 * len(stamps))])
    return stamps


def in_frame(rng: np.random.Generator, estimate: Trajectory, alignment: str) -> Trajectory:
    """Return an estimate in a coordinate frame such as systems use, which the alignment removes."""
    poses = estimate.poses.copy()
    match rng.choice(FRAMES[alignment]):
        case "of the first pose":
            poses = inverse_poses(poses[:1]) @ poses
        case "yaw":
            rotation = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi, 1))
            poses = _poses(rotation, 5 * rng.normal(size=(1, 3))) @ poses
        case "any":
            rotation = Rotation.random(1, random_state=rng)
            poses = _poses(rotation, 5 * rng.normal(size=(1, 3))) @ poses
            poses[:, :3, 3] *= np.exp(rng.normal()) if alignment == "similarity" else 1.0
    return estimate._replace(poses=poses)


def draw(rng: np.random.Generator, real: RealPairs, *, metric: bool) -> Pair:
    """Return files without a mistake: random ones, or a random part of real ones."""
    alignment = "rigid" if metric else "similarity"
    if real and rng.random() < 0.3:
        truth, estimate = real[int(rng.integers(len(real)))]
        start = rng.uniform(0, 0.6) * np.ptp(truth.keys) + truth.keys[0]
        end = start + rng.uniform(0.25, 0.4) * np.ptp(truth.keys)
        truth, estimate = (_between(path, start, end) for path in (truth, estimate))
        return Pair(Written(truth, True), Written(estimate, True), {"alignment": alignment})
    if rng.random() < OTHER_ALIGNMENTS:
        alignment = str(rng.choice(["rigid", "yaw", "none"]))
    kind = rng.choice(["hand", "drone", "car", "around an object"])
    rate = float(rng.choice([10, 20, 30, 100]))
    truth = make_path(rng, kind, rng.uniform(20, 90), rate)
    stamps, table = truth.keys, rng.random() < 0.75  # otherwise by row, in KITTI's format
    while table:
        other_rate = rng.choice([5.0, 10, 20, 30])
        stamps = np.arange(truth.keys[0], truth.keys[-1], 1 / other_rate)[1:-1]
        stamps = estimated_stamps(rng, stamps + rng.uniform(0, 0.01))
        if len(stamps) >= MIN_POSES:
            break
    estimate = in_frame(rng, estimate_of(rng, truth, stamps), alignment)
    reference, estimated = (Written(path, bool(table)) for path in (truth, estimate))
    return Pair(reference, estimated, {"alignment": alignment})


def _between(path: Trajectory, start: float, end: float) -> Trajectory:
    """Return a part of a path, with its stamps since the start."""
    rows = (path.keys >= start) & (path.keys <= end)
    return Trajectory(path.keys[rows] - start, path.poses[rows])


def with_mistake(rng: np.random.Generator, pair: Pair, name: str) -> tuple[Pair, Pair]:
    """Return the pair without a mistake, and with it in one file or both."""
    if not name:
        return pair, pair
    mistake = MISTAKES[name]
    files = mistake.files[int(rng.integers(len(mistake.files)))]
    seed = int(rng.integers(2**32))  # the same mistake in both
    if name == "axes swapped":
        reference = replace(pair.reference, positions_only=pair.reference.table)
        pair = replace(pair, reference=reference)
    reference, estimate = (
        mistake.make(written, np.random.default_rng(seed)) if file in files else written
        for file, written in ((REF, pair.reference), (EST, pair.estimate))
    )
    return pair, Pair(reference, estimate, pair.settings, name, files)


def _with(written: Written, poses: Floats) -> Written:
    return replace(written, path=written.path._replace(poses=poses))


def _late(written: Written, rng: np.random.Generator) -> Written:
    offset = rng.choice([-1, 1]) * 10 ** rng.uniform(-1.3, rng.choice([1.0, 8.0]))
    return replace(written, path=written.path._replace(keys=written.path.keys + offset))


def _of_later_rows(written: Written, rng: np.random.Generator) -> Written:
    poses = written.path.poses
    first = int(rng.integers(2, 3 + len(poses) // 33))
    return _with(written, np.concatenate([poses[first:], poses[-1:].repeat(first, axis=0)]))


def _in_other_units(written: Written, rng: np.random.Generator) -> Written:
    return replace(written, per_second=float(rng.choice([1e3, 1e6])))


def _in_other_lengths(written: Written, rng: np.random.Generator) -> Written:
    poses = written.path.poses.copy()
    poses[:, :3, 3] *= rng.choice([1e3, 1e2, 3.28084])
    return _with(written, poses)


def _inverted(written: Written, _: np.random.Generator) -> Written:
    return _with(written, inverse_poses(written.path.poses))


def _transposed(written: Written, _: np.random.Generator) -> Written:
    poses = written.path.poses.copy()
    poses[:, :3, :3] = poses[:, :3, :3].swapaxes(1, 2)
    return _with(written, poses)


def _translations(written: Written, _: np.random.Generator) -> Written:
    poses = written.path.poses.copy()
    poses[:, :3, 3] = inverse_poses(poses)[:, :3, 3]
    return _with(written, poses)


def _w_first(written: Written, _: np.random.Generator) -> Written:
    return replace(written, w_first=True)


def _inverted_w_first(written: Written, rng: np.random.Generator) -> Written:
    return _w_first(_inverted(written, rng), rng)


def _other_axes(written: Written, rng: np.random.Generator) -> Written:
    return _with(written, written.path.poses @ OTHER_AXES[rng.integers(len(OTHER_AXES))])


def _mounted(written: Written, rng: np.random.Generator) -> Written:
    direction = rng.normal(size=3)
    angle = np.radians(rng.uniform(20, 90))
    rotation = Rotation.from_rotvec([angle * direction / np.linalg.norm(direction)])
    return _with(written, written.path.poses @ _poses(rotation, np.zeros((1, 3))))


def _left_handed(written: Written, rng: np.random.Generator) -> Written:
    mirror = np.diag([*rng.permutation([1.0, 1.0, -1.0]), 1.0])
    return _with(written, mirror @ written.path.poses @ mirror)


def _swapped(written: Written, _: np.random.Generator) -> Written:
    swap = np.eye(4)[[1, 0, 2, 3]]
    return _with(written, swap @ written.path.poses @ swap)


def _motions(written: Written, _: np.random.Generator) -> Written:
    poses = written.path.poses
    return _with(written, np.concatenate([poses[:1], inverse_poses(poses[:-1]) @ poses[1:]]))


class Mistake(NamedTuple):
    """A mistake in one file or both, and its hint."""

    make: Callable[[Written, np.random.Generator], Written]
    pattern: str  # of the hint
    files: tuple[tuple[str, ...], ...]  # which may have it, at the same time
    tables: tuple[bool, ...] = (True, False)  # whether a format is TUM's


ONE, EITHER, ANY = ((EST,),), ((REF,), (EST,)), ((REF,), (EST,), (REF, EST))
MISTAKES = {
    "clock": Mistake(_late, "its clock is off", ONE, (True,)),
    "frames": Mistake(_of_later_rows, "its frames are off", ONE, (False,)),
    "stamps": Mistake(_in_other_units, "stamps seem to be .* in {file}", ANY, (True,)),
    "lengths": Mistake(_in_other_lengths, "the positions of {file} seem to be in", EITHER),
    "inverted": Mistake(_inverted, "the poses of {file} seem to be world-to-camera", ANY),
    "rotations inverted": Mistake(_transposed, "the rotations of {file} seem to be", ANY),
    "positions inverted": Mistake(_translations, "the positions of {file} seem to be", ANY),
    "w first": Mistake(_w_first, "the quaternions of {file} seem to have w", ANY, (True,)),
    "inverted, w first": Mistake(
        _inverted_w_first, "quaternions of {file} seem .* poses of {file} seem", ANY, (True,)
    ),
    "camera axes": Mistake(_other_axes, "the camera frame", ONE),
    "mounting angle": Mistake(_mounted, "the camera frame", ONE),
    "left-handed": Mistake(_left_handed, "mirror images", EITHER),
    "axes swapped": Mistake(_swapped, "mirror images", ((REF,),)),
    "motions": Mistake(_motions, "the rows of {file} seem to be motions from", ANY),
}
KINDS = (  # kinds of hints on mistakes
    *("clock", "units", "increments", "inverted", "inverted rotations", "inverted positions"),
    *("quaternions", "frame", "mirrored"),
)


class Judged(NamedTuple):
    """The hints on a pair, the verdict on them, and the scores without the mistake and with it."""

    number: int
    alignment: str
    mistake: str
    files: str
    right: float
    score: float
    verdict: str  # "right", "wrong", or an empty string without hints
    hints: str


def judge(number: int, seed: int, mistake: str, real: RealPairs) -> Judged:
    """Draw a pair that can have the mistake, score it, and judge its hints."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    tables = MISTAKES[mistake].tables if mistake else (True, False)
    with TemporaryDirectory() as name, threadpool_limits(limits=1):
        folder, right = Path(name), 0.0
        while right < MIN_SCORE:
            drawn = draw(rng, real, metric=mistake == "lengths")
            if drawn.reference.table in tables:
                without, pair = with_mistake(rng, drawn, mistake)
                right = scored(without, folder).score
        result = scored(pair, folder)
        verdict = ""
        if result.hints:
            verdict = "right" if is_right(pair, right, result, folder) else "wrong"
    files, hints = "+".join(pair.files), " | ".join(result.hints)
    alignment = pair.settings["alignment"]
    return Judged(number, alignment, mistake, files, right, result.score, verdict, hints)


class Scored(NamedTuple):
    """The score of files, and the hints on mistakes."""

    score: float
    hints: list[str]


def scored(pair: Pair, folder: Path) -> Scored:
    """Write and score files; a refusal with a corrected score counts as a hint."""
    for file, written in ((REF, pair.reference), (EST, pair.estimate)):
        written.write(folder / file)
    try:
        result = evaluate(folder / REF, folder / EST, **pair.settings)
    except FAILURES as error:
        return Scored(0.0, [str(error)] if "corrected)" in str(error) else [])
    hints = [note for note in result.notes if isinstance(note, Hint) and note.kind in KINDS]
    return Scored(score_of(result), [*map(str, hints)])


def score_of(result: Evaluation) -> float:
    """Return the PAS, or the TAS of positions only."""
    return result.pas if result.has_rotations else result.tas


def is_right(pair: Pair, right: float, result: Scored, folder: Path) -> bool:
    """Return whether there is one hint, with a possibility that names and corrects the mistake."""
    if not pair.mistake or len(result.hints) > 1:
        return False
    file = f"both {REF} and {EST}" if len(pair.files) == 2 else re.escape(pair.files[0])
    for possibility in result.hints[0].split("; or "):
        corrected = float(re.findall(r"([0-9.]+) corrected", possibility)[-1])
        names = re.search(MISTAKES[pair.mistake].pattern.format(file=file), possibility)
        if names and corrected >= right - NEAR and follows(pair, possibility, corrected, folder):
            return True
    return False


def follows(pair: Pair, possibility: str, corrected: float, folder: Path) -> bool:
    """Return whether options reach the corrected score; True for advice to change files."""
    advice = possibility.split("corrected); ")[-1].split("; ")[0]
    value = r"'([^']*)'|(auto|interpolate|similarity)|(-?[0-9.]+)"
    options = re.findall(f"--([a-z_]+)(?: (?:{value}))?", advice)
    if not options or advice.startswith(("write", "leave out")) or ", then" in advice:
        return True
    settings = {
        name: quoted or word or (float(number) if number else True)
        for name, quoted, word, number in options
    }
    try:
        result = evaluate(folder / REF, folder / EST, **pair.settings | settings)
    except FAILURES:
        return False
    return abs(score_of(result) - corrected) <= 0.01


def counts(judged: pd.DataFrame) -> pd.DataFrame:
    """Return the numbers of pairs, of costly mistakes and of verdicts, for each mistake."""
    costly = judged.right - judged.score >= MIN_COST
    columns = {
        "pairs": judged.right > 0,
        "costly": costly,
        "named": costly & (judged.verdict == "right"),
        "silent": costly & (judged.verdict == ""),
        "wrong": judged.verdict == "wrong",
    }
    return pd.DataFrame(columns).groupby(judged.mistake.replace("", "none"), sort=False).sum()


def read_real(reference: str, estimate: str) -> tuple[Trajectory, Trajectory]:
    """Read a real pair; frames are 0.1 s apart."""
    result = evaluate(reference, estimate)
    if result.reference.keys.dtype.kind == "U":
        raise ValueError(f"{reference} has image names, not times or frames")
    paths = []
    for keys, poses in (result.reference, result.estimate):
        paths.append(Trajectory(keys / 10 if keys.dtype.kind == "i" else keys, poses))
    return paths[0], paths[1]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print counts for each mistake, and for pairs without one."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.hints", description=__doc__)
    parser.add_argument(
        "--pairs", type=int, default=200, help="with a mistake, and as many without (200)"
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the random pairs (0)")
    parser.add_argument("--n_jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--mistakes", nargs="+", default=[*MISTAKES], choices=MISTAKES, metavar="M")
    real = "a real pair without a mistake; random parts of it are drawn, too"
    parser.add_argument("--real", nargs=2, action="append", default=[], help=real)
    parser.add_argument("--output", type=Path, help="CSV file with the hints on each pair")
    options = parser.parse_args(arguments)
    if options.pairs < 1:
        parser.error("argument --pairs: must be at least 1")
    if options.output and options.output.exists():
        parser.error(f"argument --output: {options.output} exists; name another file")
    if options.output and not options.output.parent.is_dir():
        parser.error(f"argument --output: there is no folder {options.output.parent}")
    try:
        real_pairs = [read_real(*files) for files in options.real]
    except FAILURES as error:
        parser.error(f"argument --real: {error}")
    names = [options.mistakes[i % len(options.mistakes)] for i in range(options.pairs)]
    names += [""] * options.pairs
    judged = Parallel(n_jobs=options.n_jobs, return_as="generator")(
        delayed(judge)(number, options.seed, name, real_pairs) for number, name in enumerate(names)
    )
    table = pd.DataFrame(tqdm(judged, total=len(names)), columns=Judged._fields)
    if options.output:
        table.to_csv(options.output, index=False)
    print(counts(table).to_string())
    return 0


if __name__ == "__main__":
    sys.exit(main())
