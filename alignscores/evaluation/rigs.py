"""Camera rigs: which poses are of one rig frame, and whether d is the baseline of a rig."""

import re
from collections.abc import Mapping
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Floats, Indices
from ..io import Trajectory, is_model, read_rig_frames
from ..translation import closest_pair_quartile
from ..validation import check_groups
from .settings import Settings

__all__ = ["clumps", "of_groups", "of_model", "of_reference", "rig_frames", "unit_of"]

FAR = 3  # times as distant; on a smooth path it is twice at most
MAX_CAMERAS = 12  # of a rig
SAMPLE = 200  # cameras whose neighbours are looked for


def of_groups(reference: Any, groups: ArrayLike) -> dict[Any, int]:
    """Return the rig frames of the poses of a reference in memory, by their keys."""
    if not isinstance(reference, Trajectory):
        raise ValueError(
            "groups need a reference in memory, whose rows they label: an array or a Trajectory; "
            "of files rig_frames names the rig frames"
        )
    labels = check_groups(groups, len(reference.keys), "the reference").tolist()
    rows = zip(reference.keys.tolist(), labels, strict=True)
    return dict(reversed(list(rows)))  # of those with the same key the first one counts


def of_model(reference: Any, settings: Settings) -> dict[Any, int]:
    """Return the rig frames of the images of a COLMAP model; none of any other reference.

    In fewer than four, as of a dome of cameras that all look at once, each camera counts.
    """
    is_file = settings.format == "colmap" and isinstance(reference, (str, PathLike))
    if settings.rig_frames != "auto" or not (is_file or is_model(reference)):
        return {}
    frames = read_rig_frames(reference)
    return dict(frames) if len(set(frames.values())) >= 4 else {}


def of_reference(
    reference: Trajectory, frames: Mapping[Any, int], settings: Settings
) -> Indices | None:
    """Return the rig frame of each pose by its key, or by consecutive rows; None without either.

    A key without a rig frame has its own.
    """
    if frames:
        n = max(frames.values()) + 1
        keys = enumerate(reference.keys.tolist())
        return np.array([frames.get(key, n + row) for row, key in keys])
    if not settings.rig_frames.isdecimal():
        return None
    n, n_cameras = len(reference.keys), int(settings.rig_frames)
    if n % n_cameras:
        raise ValueError(f"rig_frames {n_cameras}: the reference has {n} poses, no multiple of it")
    return np.arange(n) // n_cameras


def rig_frames(keys: NDArray[Any], positions: Floats, settings: Settings) -> Indices | None:
    """Return a label for each image, the same for those of one rig frame; None without a rig.

    Images with the same file name in different folders are of one rig frame if they are closer
    together than rig frames are: several recordings can have the same file names, too.
    """
    if keys.dtype.kind != "U" or settings.rig_frames == "none":
        return None
    if settings.rig_frames == "auto":
        frames = [key.rpartition("/")[2] for key in keys]
    else:
        matches = [re.search(settings.rig_frames, key) for key in keys]
        if not any(matches):
            raise ValueError(f"rig_frames: no name fits, such as {str(keys[0])!r}")
        frames = [
            match.group(1) if match else key for match, key in zip(matches, keys, strict=True)
        ]
    _, labels, counts = np.unique(frames, return_inverse=True, return_counts=True)
    if counts.max() == 1:
        return None
    if settings.rig_frames == "auto":
        means = np.stack([np.bincount(labels, axis) for axis in positions.T], axis=1)
        distances = np.linalg.norm(positions - (means / counts[:, None])[labels], axis=1)
        if not np.median(distances) < unit_of(positions, labels):
            return None
    return labels


def clumps(positions: Floats, d: float) -> tuple[int, float]:
    """Return of how many cameras clumps are, and how far they are apart; zeros without clumps.

    Cameras lie in clumps of k if for most of them the k-th neighbour is far more distant than the
    one before, and by their upper quartile, as of d, far more than d. On a smooth path neighbours
    are 1, 1, 2, 2, ... steps away, and at random positions distances grow still more evenly.
    """
    k = min(MAX_CAMERAS, len(positions) // 4)  # d needs four rig frames
    if k < 2:
        return 0, 0.0
    # Importing SciPy's k-d tree takes as long as scoring a short recording.
    rows = np.linspace(0, len(positions) - 1, min(SAMPLE, len(positions))).astype(int)
    lengths = (np.linalg.norm(positions - positions[row], axis=1) for row in rows)
    nearest = np.stack([np.partition(row_lengths, k)[: k + 1] for row_lengths in lengths])
    distances = np.sort(nearest, axis=1)[:, 1:]
    far = np.mean(distances[:, 1:] > FAR * distances[:, :-1], axis=0)
    n = int(np.argmax(far)) + 1
    spacing = float(np.quantile(distances[:, n], 0.75, method="inverted_cdf"))
    return (n + 1, spacing) if far[n - 1] > 0.5 and spacing > FAR * d else (0, 0.0)


def unit_of(positions: Floats, labels: Indices | None) -> float:
    """Return d of positions, or of rig frames by their labels; NaN where it is undefined."""
    try:
        return closest_pair_quartile(positions, groups=labels)
    except ValueError:
        return np.nan
