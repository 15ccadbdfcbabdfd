"""The formats of trajectory files that the command reads."""

from collections.abc import Callable
from dataclasses import dataclass

from . import files

__all__ = ["FORMATS", "Format"]


@dataclass(frozen=True)
class Format:
    """A format of trajectory files."""

    help: str  # what a file holds
    read: Callable[..., files.Trajectory]
    suffixes: tuple[str, ...] = ()  # of names that no other format has
    unit: str = "m"  # name of the reference's unit of length
    timed: bool = False  # whether poses are matched by time stamps
    topics: bool = False  # whether a file may hold several trajectories, by topic
    tables: bool = False  # whether it is a text table, whose columns can be named
    ordered: bool = True  # whether poses come in the order of time

    def options(self, topic: str | None, columns: str | None) -> dict[str, str | None]:
        """Return the options that the reader takes."""
        return {"topic": topic} if self.topics else {"columns": columns} if self.tables else {}


FORMATS = {
    "tum": Format(
        "text tables, 'timestamp tx ty tz qx qy qz qw' or with a header that names the columns",
        files.read_tum,
        timed=True,
        tables=True,
    ),
    "kitti": Format(
        "a 3x4 or 4x4 camera-to-world matrix a line, matched by line; 12 nan for a lost frame",
        files.read_kitti,
        tables=True,
    ),
    "euroc": Format(
        "EuRoC's data.csv as reference; estimates like it, or in TUM format",
        files.read_euroc,
        timed=True,
        tables=True,
    ),
    "colmap": Format(
        "folders of COLMAP models, such as sparse/0, matched by image name",
        files.read_colmap,
        unit="units",
        ordered=False,
    ),
    "matrices": Format(
        "folders with one 4x4 matrix per file (7-Scenes, ScanNet), matched by number in the name",
        files.read_matrices,
    ),
    "arrays": Format(
        "NumPy's .npy or .npz with (n,4,4) or (n,3,4) matrices, matched by their stamps or rows",
        files.read_arrays,
        suffixes=(".npy", ".npz"),
        timed=True,
    ),
    "bag": Format(
        "bags of ROS 1 and 2, and MCAP, read by evo; an estimate may be a TUM file",
        files.read_bag,
        suffixes=(".bag", ".mcap", ".db3"),
        timed=True,
        topics=True,
    ),
    "nerf": Format(
        "transforms.json, or nerfstudio's exported cameras, matched by file_path",
        files.read_nerf,
        unit="units",
        ordered=False,
    ),
}
