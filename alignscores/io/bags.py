"""Bags of ROS 1 and 2, and MCAP files, through evo."""

from pathlib import Path
from typing import Any

import numpy as np

from ..extras import require
from ..files import FileError, FilePath, Source, open_file
from .trajectory import (
    Trajectory,
    check_stamps,
    checked,
    poses_from_quaternions,
)

__all__ = ["read_bag"]

MAX_BYTES = 10**13  # of a bag; most are images


def read_bag(path: FilePath, *, topic: str | None = None) -> Trajectory:
    """Read the poses of a topic of a bag, as evo does.

    Parameters
    ----------
    path : path
        A bag of ROS 1 (``.bag``), the folder of one of ROS 2, or its file, ``.mcap`` or ``.db3``.
    topic : str, optional
        A topic with poses, odometry or transforms; or, with evo's syntax, a transform,
        ``/tf:map.base_link``. By default the only one that the bag has.

    Returns
    -------
    Trajectory
        Time stamps of the messages in seconds, and poses.

    Raises
    ------
    FileError
        Where the bag cannot be read, or the topic is none of poses, or there are several.
    ModuleNotFoundError
        Where evo is not installed.

    Examples
    --------
    >>> from alignscores.io import read_bag
    >>> stamps, poses = read_bag("run.mcap", topic="/odom")  # doctest: +SKIP
    """
    evo = require("evo.tools.file_interface", "evo")
    folder = Path(path)
    if not folder.is_dir():
        open_file(path, MAX_BYTES).close()  # no device, and there is one
    reader = evo.Rosbag1Reader if folder.suffix == ".bag" else evo.Rosbag2Reader
    try:
        with reader(folder) as bag:
            read = evo.read_bag_trajectory(bag, topic or _only_topic(path, bag, evo))
    except FileError:
        raise
    except Exception as error:  # of rosbags, whose readers raise whatever a broken file leads to
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FileError(path, f"is not a readable bag ({reason})") from None
    if read.num_poses == 0:
        raise FileError(path, f"has no poses on {topic}")
    quaternions = np.roll(read.orientations_quat_wxyz, -1, axis=1)
    source = Source(path, lambda row: f"message {row + 1}")
    poses = poses_from_quaternions(read.positions_xyz, quaternions, source)
    check_stamps(read.timestamps, source)
    return checked(read.timestamps, poses, source)


def _only_topic(path: FilePath, bag: Any, evo: Any) -> str:
    """Return the topic with poses where there is one; else the error names them."""
    topics = sorted(
        {each.topic for each in bag.connections if each.msgtype in evo.SUPPORTED_ROS_MSGS}
    )
    if len(topics) != 1:
        has = f"has {', '.join(topics)}" if topics else "has no topic with poses"
        raise FileError(path, f"{has}; --ref_topic and --est_topic name one")
    return str(topics[0])
