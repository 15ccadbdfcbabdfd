"""Today's metrics of camera poses, each exactly as its origin defines it, under its name.

One function a protocol, named after where it comes from; `protocol` finds them by short names such
as ``auc@30:vggt``. Where an origin surprises, so does the function: they are there so that numbers
compare, not because they are good. The table is in docs/reference/protocols.md, the surprises are
in docs/explanation/other-metrics.md.
"""

from .cameras import NoValueError
from .colmap import colmap_relative_auc
from .families import Family, Metric, split_names
from .images import hloc_median, hloc_recall
from .matching import pair_auc, pair_pose_errors
from .registry import PROTOCOLS, protocol
from .relative import vggt_auc, vggt_rra, vggt_rta
from .segments import kitti_relative_error, rpg_relative_error
from .trajectory import evo_are, evo_ate, evo_rpe
from .video import video_error

__all__ = [
    "PROTOCOLS",
    "Family",
    "Metric",
    "NoValueError",
    "colmap_relative_auc",
    "evo_are",
    "evo_ate",
    "evo_rpe",
    "hloc_median",
    "hloc_recall",
    "kitti_relative_error",
    "pair_auc",
    "pair_pose_errors",
    "protocol",
    "rpg_relative_error",
    "split_names",
    "vggt_auc",
    "vggt_rra",
    "vggt_rta",
    "video_error",
]
