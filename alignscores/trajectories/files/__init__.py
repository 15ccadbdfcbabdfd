"""Readers of trajectory files: a module for each format.

Every reader returns a `Trajectory`, a pair ``keys, poses`` with camera-to-world poses. Poses that
are not finite are cameras that were not estimated; of a reference, nothing is expected there.
Whatever is wrong with a file is a `FileError` that names file, line and reason.
"""

from .arrays import read_arrays
from .bags import read_bag
from .colmap import read_colmap
from .columns import parse_columns
from .euroc import read_euroc
from .kitti import read_kitti
from .matrices import read_matrices
from .nerf import read_nerf
from .poses import Trajectory, TrajectoryWarning, inverse_poses
from .tables import read_stamps
from .text import FAILURES, FileError, FilePath
from .tum import read_tum

__all__ = [
    "FAILURES",
    "FileError",
    "FilePath",
    "Trajectory",
    "TrajectoryWarning",
    "inverse_poses",
    "parse_columns",
    "read_arrays",
    "read_bag",
    "read_colmap",
    "read_euroc",
    "read_kitti",
    "read_matrices",
    "read_nerf",
    "read_stamps",
    "read_tum",
]
