"""The formats of trajectory files that the command reads."""

from collections.abc import Callable
from dataclasses import dataclass

from . import files

__all__ = ["FORMATS", "Format"]


@dataclass(frozen=True)
class Format:
    """A format of trajectory files."""

    help: str  # what a file holds
    example: str  # arguments of the command
    read: Callable[..., files.Trajectory]
    missing: bool  # not where each line of the reference has one of the estimate
    unit: str = "m"  # name of the reference's unit of length
    timed: bool = False  # whether poses are matched by time stamps
    quaternions: bool = False  # whether rotations are quaternions
    ordered: bool = True  # whether poses come in the order of time
    aligned: str = ""  # format of an aligned estimate; empty where there is none
    read_parts: Callable[..., dict[str, files.Trajectory]] | None = None  # of an estimate


FORMATS = {
    "tum": Format(
        "time stamps and poses, 'timestamp tx ty tz qx qy qz qw'",
        "groundtruth.txt orb_slam.txt dso.txt",
        files.read_tum,
        True,
        timed=True,
        quaternions=True,
        aligned="TUM",
    ),
    "kitti": Format(
        "a 3x4 or 4x4 camera-to-world matrix a line, matched by line; 12 nan for a lost frame",
        "00_gt.txt 00_est.txt --save_plot 00.png",
        files.read_kitti,
        False,
        aligned="KITTI",
    ),
    "euroc": Format(
        "EuRoC's data.csv as reference; estimates like it, or in TUM format",
        "data.csv vio.txt --t_max_diff 0.02 --json > scores.json",
        files.read_euroc,
        True,
        timed=True,
        quaternions=True,
        aligned="TUM",
    ),
    "colmap": Format(
        "folders of COLMAP models, matched by image name; an estimate may be a folder of several",
        "reference/sparse/0 mine/sparse/0 --save_results mine.zip",
        files.read_colmap,
        True,
        unit="units",
        quaternions=True,
        ordered=False,
        read_parts=files.read_colmap_parts,
    ),
    "nerf": Format(
        "transforms.json, matched by file_path",
        "transforms.json estimate.json --body_rotation auto",
        files.read_nerf,
        True,
        unit="units",
        ordered=False,
    ),
}
