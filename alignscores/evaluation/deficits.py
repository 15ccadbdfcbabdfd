"""Stretches of frames that cost a score most.

A frame lacks the share of the thresholds that its error reaches: nothing with an error of 0, all of
it from the largest threshold on, and where the frame is lost. The mean over the frames is what the
score lacks to 1.
"""

import re
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Booleans, Floats, Indices

__all__ = ["Deficit", "deficits", "order_of_frames"]

N_STRETCHES = 3


@dataclass(frozen=True)
class Deficit:
    """Cost of some frames for a score: a stretch of one cause, or the rest of this cause.

    Parameters
    ----------
    score : {"TAS", "RAS"}
        The score.
    cause : {"lost", "position", "rotation"}
        Frames without a pose, or the errors of frames that have one.
    start, end : float, int, str or None
        First and last frame of a stretch: seconds from the start of the reference, numbers of
        frames, or names of images, which are in alphabetical order. None for the rest.
    frames : int
        Number of scored frames.
    cost : float
        What they cost the score. All costs of a score add up to 1 minus the score.
    share : float
        The cost as a share of 1 minus the score.
    """

    score: str
    cause: str
    start: float | int | str | None
    end: float | int | str | None
    frames: int
    cost: float
    share: float


def deficits(
    score: str, errors: Floats, thresholds: Floats, lost: Booleans, keys: NDArray[Any]
) -> list[Deficit]:
    """Return what costs a score: up to three stretches, the costliest first, then the rest.

    The stretches are those that cost most in excess of as many average frames. The result is empty
    if the score is 1.
    """
    order = order_of_frames(keys)
    lost = lost[order]
    missing = np.searchsorted(thresholds, errors[order], side="right")  # thresholds of each frame
    total, n = int(missing.sum()), len(missing)
    if total == 0:
        return []
    changes = np.flatnonzero(np.diff(lost)) + 1
    # Whole numbers, below 2^63 up to half a million frames. The 1 decides only between equal
    # choices, for the longer one.
    excess = (n * missing - total) * (n + 1) + 1
    stretches = [np.arange(*ends) for ends in largest_sums(excess, changes, N_STRETCHES)]
    stretches.sort(key=lambda rows: -int(missing[rows].sum()))
    rest = np.ones(n, dtype=bool)
    rest[np.concatenate(stretches)] = False
    groups = [*stretches, np.flatnonzero(rest & lost), np.flatnonzero(rest & ~lost)]
    result = []
    for number, rows in enumerate(groups):
        if len(rows) == 0:
            continue
        cost = int(missing[rows].sum())
        ends = keys[order][rows[[0, -1]]].tolist() if number < len(stretches) else (None, None)
        result.append(
            Deficit(
                score=score,
                cause="lost" if lost[rows[0]] else {"TAS": "position", "RAS": "rotation"}[score],
                start=ends[0],
                end=ends[1],
                frames=len(rows),
                cost=cost / (n * len(thresholds)),
                share=cost / total,
            )
        )
    return result


def order_of_frames(keys: NDArray[Any]) -> Indices:
    """Return the order of frames: as they are, but images by their names, 9.png before 10.png."""
    if keys.dtype.kind != "U":
        return np.arange(len(keys))
    parts = [re.split(r"(\d+)", name) for name in keys.tolist()]
    natural = [[int(p) if i % 2 else p for i, p in enumerate(name)] for name in parts]
    return np.array(sorted(range(len(keys)), key=natural.__getitem__), dtype=np.intp)


def largest_sums(
    values: NDArray[np.int64], changes: Indices, n_ranges: int
) -> list[tuple[int, int]]:
    """Return the disjoint ranges, at most so many, with the largest sum of values.

    No range spans one of the `changes`. There are as few as reach the sum, and at least one.
    """
    # Dynamic programming: best[k][j] is the largest sum of k ranges among the first j values;
    # opened[k][j] with the last range open at j, less the sum of the first j values.
    total = np.concatenate([[0], np.cumsum(values)])
    best = [np.zeros_like(total)]
    opened = [best[0]]
    starts = [0, *changes.tolist()]
    for k in range(1, n_ranges + 1):
        opened.append(np.empty_like(total))
        best.append(np.full_like(total, np.iinfo(np.int64).min))
        for first, last in pairwise([*starts, len(values)]):
            part, before = slice(first, last + 1), best[k][first]
            opened[k][part] = np.maximum.accumulate(best[k - 1][part] - total[part])
            best[k][part] = np.maximum.accumulate(opened[k][part] + total[part])
            best[k][part] = np.maximum(best[k][part], before)
    ranges: list[tuple[int, int]] = []
    end = len(values)
    for k in range(max(1, int(np.argmax([row[-1] for row in best]))), 0, -1):
        end = int(np.argmax(best[k][: end + 1] == best[k][end]))
        first = max(row for row in starts if row < end)
        part = slice(first, end + 1)
        opening = np.maximum.accumulate(best[k - 1][part] - total[part])
        start = first + int(np.argmax(opening == opening[-1]))
        ranges.append((start, end))
        end = start
    return ranges[::-1]
