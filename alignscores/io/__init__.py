"""Files of trajectories: a reader for each family of formats, and which format a file has.

Every reader returns a `Trajectory`, a pair ``keys, poses`` with camera-to-world poses. Poses that
are not finite are cameras that were not estimated; of a reference, nothing is expected there.
Whatever is wrong with a file is a `FileError` that names file, line and reason. What a user should
know of a file that is read is a `TrajectoryWarning`.

A new format is a module with a reader and an entry of `formats.FORMATS`.
"""

from ..files import FAILURES, FileError, FilePath
from .arrays import read_arrays
from .bags import read_bag
from .colmap import is_model, read_colmap, read_colmap_models, read_rig_frames
from .columns import parse_columns
from .formats import FORMATS, Format, recognise
from .g2o import read_g2o
from .scenes import read_nerf, read_opensfm, read_opensfm_models
from .text import (
    read_euroc,
    read_hloc,
    read_kitti,
    read_matrices,
    read_names,
    read_stamps,
    read_tum,
)
from .trajectory import Trajectory, TrajectoryWarning, in_seconds, inverse_poses

__all__ = [
    "FAILURES",
    "FORMATS",
    "FileError",
    "FilePath",
    "Format",
    "Trajectory",
    "TrajectoryWarning",
    "in_seconds",
    "inverse_poses",
    "is_model",
    "parse_columns",
    "read_arrays",
    "read_bag",
    "read_colmap",
    "read_colmap_models",
    "read_euroc",
    "read_g2o",
    "read_hloc",
    "read_kitti",
    "read_matrices",
    "read_names",
    "read_nerf",
    "read_opensfm",
    "read_opensfm_models",
    "read_rig_frames",
    "read_stamps",
    "read_tum",
    "recognise",
]
