"""The formats of trajectory files, and which of them a file has."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..files import FileError, FilePath, read_head
from .arrays import read_arrays
from .bags import read_bag
from .colmap import has_model, is_images, read_colmap, read_colmap_models
from .g2o import is_g2o, read_g2o
from .scenes import is_json, is_opensfm, read_nerf, read_opensfm, read_opensfm_models
from .text import (
    format_of_table,
    has_matrices,
    read_euroc,
    read_hloc,
    read_kitti,
    read_matrices,
    read_names,
    read_tum,
)
from .trajectory import Trajectory

__all__ = ["FORMATS", "Format", "recognise"]


@dataclass(frozen=True)
class Format:
    """A format of trajectory files.

    A file has the first format whose suffix, folder or beginning it has; the others are text
    tables, whose columns tell which it is.
    """

    help: str  # what a file holds
    read: Callable[..., Trajectory]
    suffixes: tuple[str, ...] = ()  # of names that no other format has
    is_folder: Callable[[Path], bool] | None = None  # by what is in it
    begins: Callable[[str], bool] | None = None  # by the beginning of the text
    unit: str = "m"  # name of the reference's unit of length
    timed: bool = False  # whether poses are matched by time stamps
    topics: bool = False  # whether a file may hold several trajectories, by topic
    tables: bool = False  # whether it is a text table, whose columns can be named
    inverted: bool = False  # whether poses are world-to-camera, and inverted when they are read
    w_first: bool = False  # whether quaternions have w first by definition
    ordered: bool = True  # whether poses come in the order of time
    read_models: Callable[..., dict[str, Trajectory]] | None = None  # of a file with several

    def options(self, topic: str | None, columns: str | None) -> dict[str, str | None]:
        """Return the options that the reader takes."""
        return {"topic": topic} if self.topics else {"columns": columns} if self.tables else {}


FORMATS = {
    "tum": Format(
        "text tables, 'timestamp tx ty tz qx qy qz qw' or with a header that names the columns",
        read_tum,
        timed=True,
        tables=True,
    ),
    "kitti": Format(
        "a 3x4 or 4x4 camera-to-world matrix a line, matched by line; 12 nan for a lost frame",
        read_kitti,
        tables=True,
    ),
    "euroc": Format(
        "EuRoC's data.csv as reference; estimates like it, or in TUM format",
        read_euroc,
        timed=True,
        tables=True,
    ),
    "names": Format(
        "text tables of image names and camera-to-world poses, matched by name",
        read_names,
        tables=True,
        ordered=False,
    ),
    "hloc": Format(
        "text tables 'name qw qx qy qz tx ty tz', world-to-camera, matched by name",
        read_hloc,
        inverted=True,
        w_first=True,
        unit="units",
        tables=True,
        ordered=False,
    ),
    "colmap": Format(
        "folders of COLMAP models, such as sparse/0, or their images.*, matched by image name",
        read_colmap,
        suffixes=(".bin",),
        is_folder=has_model,
        begins=is_images,
        inverted=True,
        w_first=True,
        unit="units",
        ordered=False,
        read_models=read_colmap_models,
    ),
    "matrices": Format(
        "folders with one 4x4 matrix per file (7-Scenes, ScanNet), matched by number in the name",
        read_matrices,
        is_folder=has_matrices,
    ),
    "arrays": Format(
        "NumPy's .npy or .npz with (n,4,4) or (n,3,4) matrices, matched by their stamps or rows",
        read_arrays,
        suffixes=(".npy", ".npz"),
        timed=True,
    ),
    "bag": Format(
        "bags of ROS 1 and 2, and MCAP, read by evo; an estimate may be a TUM file",
        read_bag,
        suffixes=(".bag", ".mcap", ".db3"),
        is_folder=lambda folder: (folder / "metadata.yaml").is_file(),
        timed=True,
        topics=True,
    ),
    "opensfm": Format(
        "OpenSfM's reconstruction.json, matched by image name",
        read_opensfm,
        begins=is_opensfm,
        inverted=True,
        unit="units",
        ordered=False,
        read_models=read_opensfm_models,
    ),
    "nerf": Format(
        "transforms.json, or nerfstudio's exported cameras, matched by file_path",
        read_nerf,
        begins=is_json,
        unit="units",
        ordered=False,
    ),
    "g2o": Format(
        "pose graphs of g2o with VERTEX_SE3:QUAT, matched by number",
        read_g2o,
        begins=is_g2o,
    ),
}

NOT_READ = {  # beginnings of files of other programs
    "Format Version,": "an export of OptiTrack's Motive",
    "Segments": "an export of Vicon's Nexus",
    "NO_OF_FRAMES": "an export of Qualisys",
    "# Bundle file": "Bundler's bundle.out",
    "drews 1.0": "MVE's synth_0.out",
    "NVM_V3": "VisualSFM's NVM",
    "# .PCD": "a point cloud",
    "ply": "a point cloud",
    "$G": "a log of NMEA sentences",
    "<?xml": "XML, such as GPX or KML",
    "<gpx": "GPX",
    "<!DOCTYPE": "a web page",
    "version https://git-lfs": "a pointer of Git LFS to the file",
    "Visual Landmark Dataset": "Cambridge Landmarks' list of images",
    "VERTEX3 ": "a pose graph of TORO",
}


def recognise(path: FilePath, columns: str | None = None) -> str:
    """Return the format of a file or a folder; the error says why none is recognised.

    `columns` names the columns of a text table.
    """
    file = Path(path)
    if file.is_dir():
        for name, file_format in FORMATS.items():
            if file_format.is_folder and file_format.is_folder(file):
                return name
        reason = "is a folder with no COLMAP model, bag or matrices in .txt files"
        raise FileError(path, f"{reason}; name the format: alignscores FORMAT REF EST")
    for name, file_format in FORMATS.items():
        if file.suffix in file_format.suffixes:
            return name
    text = read_head(path)
    for name, file_format in FORMATS.items():
        if file_format.begins and file_format.begins(text):
            return name
    if not columns and (other := next(filter(text.startswith, NOT_READ), "")):
        remedy = "write a table 'timestamp x y z qx qy qz qw'"
        raise FileError(path, f"is {NOT_READ[other]}, which is not read; {remedy}")
    return format_of_table(path, columns)
