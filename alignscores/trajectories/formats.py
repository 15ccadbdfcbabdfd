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
    missing: bool = True  # not where each line of the reference has one of the estimate
    unit: str = "m"  # name of the reference's unit of length
    timed: bool = False  # whether poses are matched by time stamps
    quaternions: bool = False  # whether rotations are quaternions
    topics: bool = False  # whether a file may hold several trajectories, by topic
    tables: bool = False  # whether it is a text table, whose columns can be named
    ordered: bool = True  # whether poses come in the order of time
    aligned: str = ""  # format of an aligned estimate; empty where there is none
    read_parts: Callable[..., dict[str, files.Trajectory]] | None = None  # of an estimate

    def options(self, topic: str | None, columns: str | None) -> dict[str, str | None]:
        """Return the options that the reader takes."""
        return {"topic": topic} if self.topics else {"columns": columns} if self.tables else {}


FORMATS = {
    "tum": Format(
        "text tables, 'timestamp tx ty tz qx qy qz qw' or with a header that names the columns",
        "groundtruth.txt orb_slam.txt dso.txt",
        files.read_tum,
        timed=True,
        quaternions=True,
        tables=True,
        aligned="TUM",
    ),
    "kitti": Format(
        "a 3x4 or 4x4 camera-to-world matrix a line, matched by line; 12 nan for a lost frame",
        "00_gt.txt 00_est.txt --save_plot 00.png",
        files.read_kitti,
        missing=False,
        tables=True,
        aligned="KITTI",
    ),
    "euroc": Format(
        "EuRoC's data.csv as reference; estimates like it, or in TUM format",
        "data.csv vio.txt --t_max_diff 0.02 --json > scores.json",
        files.read_euroc,
        timed=True,
        quaternions=True,
        tables=True,
        aligned="TUM",
    ),
    "colmap": Format(
        "folders of COLMAP models, matched by image name; an estimate may be a folder of several",
        "reference/sparse/0 mine/sparse/0 --save_results mine.zip",
        files.read_colmap,
        unit="units",
        quaternions=True,
        ordered=False,
        read_parts=files.read_colmap_parts,
    ),
    "matrices": Format(
        "folders with one 4x4 matrix per file (7-Scenes, ScanNet), matched by number in the name",
        "scene0000_00/pose estimate/pose",
        files.read_matrices,
    ),
    "arrays": Format(
        "NumPy's .npy or .npz with (n,4,4) or (n,3,4) matrices, matched by their stamps or rows",
        "reference.npz vggt.npz",
        files.read_arrays,
        timed=True,
        aligned="TUM or KITTI",
    ),
    "bag": Format(
        "bags of ROS 1 and 2, and MCAP, read by evo; an estimate may be a TUM file",
        "run.mcap run.mcap --ref_topic /gt --est_topic /odom",
        files.read_bag,
        timed=True,
        quaternions=True,
        topics=True,
        aligned="TUM",
    ),
    "nerf": Format(
        "transforms.json, or nerfstudio's exported cameras, matched by file_path",
        "transforms.json estimate.json --body_rotation auto",
        files.read_nerf,
        unit="units",
        ordered=False,
    ),
}
