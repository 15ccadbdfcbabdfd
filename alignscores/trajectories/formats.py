"""The formats of trajectory files that the command reads."""

from collections.abc import Callable
from dataclasses import dataclass

from .files import (
    Trajectory,
    read_colmap,
    read_colmap_parts,
    read_euroc,
    read_kitti,
    read_nerf,
    read_tum,
)

__all__ = ["FORMATS", "Format"]


@dataclass(frozen=True)
class Format:
    """A format of trajectory files.

    Parameters
    ----------
    help : str
        What a file holds, for ``--help``.
    example : str
        Arguments of an example, for ``--help``.
    read : callable
        Reader of `alignscores.trajectories.files`.
    read_parts : callable or None
        Reader of an estimate in parts, by their names; None where there are none.
    missing : bool
        Whether cameras may be missing: not where each line of the reference has an estimate's.
    unit : str
        Name of the reference's unit of length.
    timed : bool
        Whether poses are matched by time stamps.
    ordered : bool
        Whether poses come in the order of time, in which images that are matched by name do not.
    aligned : str
        Format of an aligned estimate; empty where there is none.
    """

    help: str
    example: str
    read: Callable[..., Trajectory]
    missing: bool
    unit: str = "m"
    timed: bool = False
    ordered: bool = True
    aligned: str = ""
    read_parts: Callable[..., dict[str, Trajectory]] | None = None


FORMATS = {
    "tum": Format(
        "time stamps and poses, 'timestamp tx ty tz qx qy qz qw'",
        "groundtruth.txt orb_slam.txt dso.txt",
        read_tum,
        True,
        timed=True,
        aligned="TUM",
    ),
    "kitti": Format(
        "a 3x4 camera-to-world matrix a line, matched by line; 12 nan for a lost frame",
        "00_gt.txt 00_est.txt --save_plot 00.png",
        read_kitti,
        False,
        aligned="KITTI",
    ),
    "euroc": Format(
        "EuRoC's data.csv as reference; estimates like it, or in TUM format",
        "data.csv vio.txt --t_max_diff 0.02 --json > scores.json",
        read_euroc,
        True,
        timed=True,
        aligned="TUM",
    ),
    "colmap": Format(
        "folders of COLMAP models, matched by image name; an estimate may be a folder of several",
        "reference/sparse/0 mine/sparse/0 --save_results mine.zip",
        read_colmap,
        True,
        unit="units",
        ordered=False,
        read_parts=read_colmap_parts,
    ),
    "nerf": Format(
        "transforms.json, matched by file_path",
        "transforms.json estimate.json --body_rotation auto",
        read_nerf,
        True,
        unit="units",
        ordered=False,
    ),
}
