"""Options of evo: those that mean the same here, and what to write in place of the others."""

import argparse
from collections.abc import Callable
from typing import Any, NoReturn

from ..evaluation.settings import Settings
from ..metrics import metric
from ..show.evo import POSE_RELATIONS
from ..similarity import ALIGNMENTS
from ..texts import first_few

__all__ = ["ELSEWHERE", "add_alignment", "add_pose_relation", "alignment_of", "check_pose_relation"]
__all__ += ["metrics_with_scale"]

POSITIONS = "trans_part"
VALUES = {"angle_deg": "are:rmse", "point_distance": "ate:rmse"}  # as metrics
ELSEWHERE = {
    **dict.fromkeys(
        ["-d", "--delta", "-u", "--delta_unit", "--all_pairs", "--pairs_from_reference"],
        "evo's RPE is a metric here, such as --metrics rpe@1m, rpe@10f or rpe@1m:all",
    ),
    **dict.fromkeys(
        ["--align_origin", "--n_to_align"],
        "all poses are aligned; --alignment none compares them as they are",
    ),
    "--project_to_plane": "all three dimensions count; --alignment yaw keeps the vertical axis",
    **dict.fromkeys(
        ["--downsample", "--motion_filter"],
        "no pose is left out; --rate sets the expected frames a second",
    ),
    "--change_unit": "lengths are in the reference's unit, angles in degrees",
    "--sync_method": "it is --sync nearest or --sync interpolate here",
    "--no_warnings": "nothing is asked here, and existing files are replaced; leave it out",
    "--silent": "leave it out; 2>/dev/null hides the notes",
    **dict.fromkeys(["--debug", "--logfile"], "it is -v here"),
    **dict.fromkeys(
        ["-c", "--config"], "a YAML file of settings is for `alignscores compare FILE.yaml`"
    ),
    **dict.fromkeys(["--rerun", "--rerun_rec_id"], "it is --save_rrd FILE.rrd here"),
    "--serialize_plot": "it is --save_plot FILE or --save_page FILE.html here",
    "--ref": "the reference is the first file here",
    "--save_table": "evo_res writes tables of --save_results; --save_csv FILE.csv is ours",
}


def add_alignment(add: Callable[..., Any]) -> None:
    """Add ``-a`` and ``-s``."""
    help = "as in evo: -a is --alignment rigid, -as is --alignment similarity"
    add("-a", "--align", action="store_true", help=help)
    add("-s", "--correct_scale", action="store_true", help="with -a: see there")


def alignment_of(
    arguments: argparse.Namespace, default: str, error: Callable[[str], NoReturn]
) -> str:
    """Return the alignment that ``-a`` and ``-s`` name, otherwise the value of ``--alignment``."""
    chosen: str = arguments.alignment
    if arguments.correct_scale and not arguments.align:
        error(
            "-s: no alignment here corrects only the scale; -as is --alignment similarity, and "
            "evo's value is --metrics ate:rmse:scale"
        )
    if not arguments.align:
        return chosen
    if words := [file for file in arguments.files if file in ALIGNMENTS]:
        error(f"-a and --align take no value; write --alignment {words[0]}")
    alignment, option = ("similarity", "-as") if arguments.correct_scale else ("rigid", "-a")
    if chosen not in (default, alignment):
        error(f"{option} is --alignment {alignment}, and --alignment is {chosen}; leave one out")
    return alignment


def metrics_with_scale(settings: Settings) -> str:
    """Return a note on metrics of evo that remove the scale, which other scores keep."""
    if settings.alignment == "similarity":
        return ""
    by_default = []
    for name in settings.metrics:
        choices = metric(name).options.get("alignment", ())
        if choices and not {*choices} & {*str(name).lower().split(":")}:
            by_default.append(str(name))
    if not by_default:
        return ""
    return (
        f"{first_few(by_default)}: aligned as by -as of evo, whatever --alignment is here; "
        f"{by_default[0]}:se3 is the value of its -a, {by_default[0]}:none without alignment"
    )


def add_pose_relation(add: Callable[..., Any]) -> None:
    """Add ``-r``."""
    help = "as in evo: the error in --save_results (default: %(default)s)"
    add("-r", "--pose_relation", choices=tuple(POSE_RELATIONS), default=POSITIONS, help=help)


def check_pose_relation(arguments: argparse.Namespace, error: Callable[[str], NoReturn]) -> None:
    """Check that ``-r`` names an error that is computed."""
    relation = arguments.pose_relation
    if relation == POSITIONS or arguments.save_results:
        return
    metric = f"--metrics {VALUES[relation]} is evo's value; " if relation in VALUES else ""
    error(
        f"-r {relation}: positions and rotations are always scored; {metric}"
        "-r is for --save_results"
    )
