"""Curves of plots and pages over time: errors of all expected frames, lost time, deficits."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats
from ..evaluation.deficits import Deficit, order_of_frames
from ..evaluation.evaluation import Evaluation
from ..evaluation.time import breaks
from ..histogram import AlignmentScore
from ..validation import finite_rows

__all__ = [
    "BEYOND",
    "Curve",
    "curve",
    "frames",
    "over_expected",
    "time_label",
    "times",
    "with_breaks",
]

BEYOND = "#1289c9"  # errors beyond the largest threshold; not a colour of the ramps


@dataclass(frozen=True)
class Curve:
    """The errors of an estimate that a score counts, over the expected frames."""

    score: str  # TAS or RAS
    label: str  # of the errors, with their unit
    result: AlignmentScore
    errors: Floats  # infinite where the frame is lost
    lost: Floats  # (m, 2), begin and end of each stretch of lost frames
    deficits: list[tuple[float, float, Deficit]]  # begin and end of each costliest stretch

    @property
    def limit(self) -> float:
        """The largest threshold."""
        return float(self.result.thresholds[-1])


def times(evaluation: Evaluation) -> Floats:
    """Return the times of the expected frames from the start in seconds, or their numbers."""
    keys, rows = evaluation.reference.keys, evaluation.matches.expected_rows
    return keys[rows] - keys[0] if evaluation.matches.timed else rows.astype(float)


def time_label(evaluation: Evaluation) -> str:
    """Return what `times` are, as an axis names them."""
    if evaluation.matches.timed:
        return "time [s]"
    return "frame" if evaluation.settings.file_format.ordered else "image"


def over_expected(evaluation: Evaluation, values: NDArray[Any], of_lost: float) -> NDArray[Any]:
    """Return values of scored frames for all expected ones; those left out have `of_lost`."""
    rows = evaluation.matches.expected_rows
    all_rows = np.full((len(rows), *values.shape[1:]), of_lost, values.dtype)
    all_rows[np.isin(rows, evaluation.matches.gt_rows)] = values
    return all_rows


def frames(evaluation: Evaluation) -> Floats:
    """Return where the expected frames are drawn: times, numbers, or ranks of names."""
    if evaluation.settings.file_format.ordered:
        return times(evaluation)
    names = evaluation.reference.keys[evaluation.matches.expected_rows]
    return np.argsort(order_of_frames(names)).astype(float)


def curve(evaluation: Evaluation, score: str) -> Curve:
    """Return what the TAS or the RAS counts; without rotations the RAS has no errors."""
    result: AlignmentScore = getattr(evaluation.result, score.lower())
    unit = evaluation.settings.file_format.unit
    errors = over_expected(evaluation, result.errors, np.inf)
    poses = evaluation.matches.est_poses
    parts = poses[:, :3, 3] if score == "TAS" else poses[:, :3, :3]
    lost = over_expected(evaluation, ~finite_rows(parts), True)
    matches, (low, high) = evaluation.matches, _edges(frames(evaluation))
    keys = evaluation.reference.keys[matches.expected_rows]
    if matches.timed:
        keys = np.round(times(evaluation), 6)
    rows = {key: row for row, key in enumerate(keys.tolist())}
    return Curve(
        score=score,
        label=f"position error [{unit}]" if score == "TAS" else "rotation error [deg]",
        result=result,
        errors=errors,
        lost=_stretches(frames(evaluation), lost),
        deficits=[
            (float(low[rows[stretch.start]]), float(high[rows[stretch.end]]), stretch)
            for stretch in evaluation.deficits
            if stretch.score == score and stretch.start is not None
        ],
    )


def _edges(x: Floats) -> tuple[Floats, Floats]:
    """Return where each frame begins and ends: half-way to its neighbours, except at gaps."""
    order = np.argsort(x)
    steps = np.diff(x[order])
    usual = float(np.median(steps)) if len(steps) else 1.0
    steps[breaks(x[order]) - 1] = usual
    low, high = np.empty(len(x)), np.empty(len(x))
    low[order] = x[order] - np.r_[usual, steps] / 2
    high[order] = x[order] + np.r_[steps, usual] / 2
    return low, high


def _stretches(x: Floats, chosen: Booleans) -> Floats:
    """Return begin and end of each stretch of chosen frames; it ends at a gap of the reference."""
    order, (low, high) = np.argsort(x), _edges(x)
    chosen = chosen[order]
    after_gap = np.isin(np.arange(len(x)), breaks(x[order]))
    begins = chosen & (after_gap | ~np.r_[False, chosen[:-1]])
    ends = chosen & np.r_[(after_gap | ~chosen)[1:], True]
    return np.column_stack([low[order[begins]], high[order[ends]]])


def with_breaks(evaluation: Evaluation, values: Floats) -> Floats:
    """Return values of the expected frames with a NaN at each gap of the reference."""
    return np.insert(values.astype(float), breaks(times(evaluation)), np.nan, axis=0)
