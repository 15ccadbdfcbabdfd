"""The command ``alignscores``: score trajectory files, ``alignscores FORMAT REF EST [EST ...]``."""

import argparse
import json
import math
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..pose import PASResult, pas
from ..registration import REGISTRATIONS
from ..similarity import Similarity
from ..trajectories.association import MISSING, Matches, coverage, in_order, match
from ..trajectories.conventions import (
    Convention,
    describe_rotation,
    find_convention,
    seem_swapped,
    turn_cameras,
)
from ..trajectories.extras import require
from ..trajectories.files import (
    FileError,
    Trajectory,
    TrajectoryWarning,
    inverse_poses,
    read_colmap,
    read_euroc,
    read_kitti,
    read_nerf,
    read_tum,
)
from ..translation import closest_pair_quartile, tas
from ..validation import AlignmentWarning, finite_rows
from .output import Scored, as_json, save_evo_results, save_figure, table, unique_names

__all__ = ["main"]

SCATTER = 0.005  # standard deviation of the TAS over the seeds that deserves a hint
SAME_UNIT = 1.03  # ratio of two d up to which scores compare: the seed changes the TAS by more
COVERED = 0.9  # share of the reference below which the rest deserves a note
DENSER = 1.5  # ratio of time steps from which a reference has poses that no estimate could have


@dataclass(frozen=True)
class Format:
    """A format of trajectory files."""

    help: str
    example: str
    read: Callable[..., Trajectory]
    missing: str
    unit: str = "m"
    timed: bool = False


FORMATS = {
    "tum": Format(
        "time stamps and poses, 'timestamp tx ty tz qx qy qz qw'",
        "groundtruth.txt orb_slam.txt dso.txt",
        read_tum,
        "ignore",
        timed=True,
    ),
    "kitti": Format(
        "a 3x4 camera-to-world matrix a line, matched by line",
        "00_gt.txt 00_est.txt --save_plot 00.png",
        read_kitti,
        "ignore",
    ),
    "euroc": Format(
        "EuRoC's data.csv as reference; estimates like it, or in TUM format",
        "data.csv vio.txt --t_max_diff 0.02 --json > scores.json",
        read_euroc,
        "ignore",
        timed=True,
    ),
    "colmap": Format(
        "folders of COLMAP models, matched by image name",
        "reference/sparse/0 mine/sparse/0 --save_results mine.zip",
        read_colmap,
        "fail",
        unit="ref. unit",
    ),
    "nerf": Format(
        "transforms.json, matched by file_path",
        "transforms.json estimate.json --body_rotation auto",
        read_nerf,
        "fail",
        unit="ref. unit",
    ),
}


EPILOG = f"""\
examples:
{chr(10).join(f"  alignscores {name} {form.example}" for name, form in FORMATS.items())}

Every score is from 0 to 1, the larger the better. `alignscores FORMAT --help` tells the options.
exit codes: 0 scored, 1 something could not be scored, 2 wrong usage
shell completion: eval "$(register-python-argcomplete alignscores)"
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; by default those of the process.

    Returns
    -------
    int
        0 if all was scored, 1 if something could not be. Wrong usage ends in ``SystemExit(2)``.
    """
    parser = build_parser()
    try:
        if "_ARGCOMPLETE" in os.environ:
            require("argcomplete", "files").autocomplete(parser)
        return run(parser.parse_args(argv))
    except BrokenPipeError:  # such as `| head`: nobody reads on
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (ModuleNotFoundError, OSError, ValueError) as error:
        fail(one_line(error))
        return 1
    except KeyboardInterrupt:
        return 130


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line: one subcommand a format."""
    parser = argparse.ArgumentParser(
        prog="alignscores",
        description="Score estimated camera trajectories against a reference: TAS (positions), RAS "
        "(rotations) and PAS (their mean), after Lee and Civera.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")
    formats = parser.add_subparsers(dest="format", metavar="FORMAT", required=True)
    for name, form in FORMATS.items():
        command = formats.add_parser(
            name,
            help=form.help,
            description=f"{name}: {form.help}.",
            epilog=f"example: alignscores {name} {form.example}",
        )
        _add_arguments(command, form)
    return parser


def _add_arguments(command: argparse.ArgumentParser, form: Format) -> None:
    command.add_argument("reference", metavar="REF", help="the reference (ground truth)")
    command.add_argument("estimates", metavar="EST", nargs="+", help="an estimate")

    matching = command.add_argument_group("which poses belong together")
    matching.add_argument(
        "--missing",
        choices=MISSING,
        default=form.missing,
        help="reference poses without an estimate count as failures, or are left out "
        "(default: %(default)s)",
    )
    if form.timed:
        add_number(matching, "--t_max_diff", 0.01, "largest difference of associated stamps, in s")
        add_number(matching, "--t_offset", 0.0, "added to the estimate's time stamps, in s")

    scoring = command.add_argument_group("scoring")
    add_number(scoring, "--unit", None, "d in the reference's unit (default: from the reference)")
    scoring.add_argument(
        "--registration",
        choices=sorted(REGISTRATIONS),
        default="pcr99",
        help="how the TAS aligns; pcr99 is the paper's (default: %(default)s)",
    )
    add_number(scoring, "--seed", 0, "seed of the registration")
    add_number(
        scoring, "--repeat", 10, "seeds, from --seed on, that the sd of the TAS is over; 1: no sd"
    )
    scoring.add_argument(
        "--invert", action="store_true", help="the estimates are world-to-camera: invert them"
    )
    scoring.add_argument(
        "--body_rotation",
        choices=("auto", "none"),
        default="none",
        help="take a constant rotation of the camera's frame out, if one is found "
        "(default: %(default)s)",
    )

    output = command.add_argument_group("output")
    output.add_argument("--json", action="store_true", help="print JSON instead of a table")
    output.add_argument(
        "--save_results",
        metavar="FILE.zip",
        type=output_file(".zip"),
        help="save for evo_res; of several estimates each gets FILE_<name>.zip",
    )
    output.add_argument("--plot", action="store_true", help="show histograms and trajectories")
    output.add_argument(
        "--save_plot",
        metavar="FILE",
        type=output_file(".png", ".pdf", ".svg"),
        help="save them as FILE (.png, .pdf or .svg)",
    )


def add_number(group: Any, option: str, default: float | None, text: str) -> None:
    """Add an option that takes a number: a whole one if the default is, else a finite one."""
    convert = int if isinstance(default, int) else float
    least = {"--t_offset": -math.inf, "--repeat": 1}.get(option, 0)
    bound = {"--t_offset": "", "--unit": " above 0"}.get(option, f" of at least {least}")

    def number(value: str) -> float:
        try:
            result = convert(value)
            if math.isfinite(result) and result >= least and (option != "--unit" or result > 0):
                return result
        except (OverflowError, ValueError):
            pass
        kind = "whole" if convert is int else "finite"
        raise argparse.ArgumentTypeError(f"must be a {kind} number{bound}, not {value!r}")

    suffix = "" if default is None else " (default: %(default)s)"
    group.add_argument(option, type=number, default=default, metavar="X", help=text + suffix)


def output_file(*suffixes: str) -> Callable[[str], Path]:
    """Return a type of argument that refuses what could not be written before all else."""

    def output(value: str) -> Path:
        path = Path(value)
        if path.suffix not in suffixes:
            raise argparse.ArgumentTypeError(f"{value} does not end in {' or '.join(suffixes)}")
        if not path.parent.is_dir():
            raise argparse.ArgumentTypeError(f"{value}: there is no folder {path.parent}")
        return path

    return output


def check_outputs_possible(arguments: argparse.Namespace) -> None:
    """Refuse outputs for which something is missing on this machine."""
    if arguments.save_results:
        require("evo", "files")
    if arguments.save_plot:
        require("matplotlib", "plots")
    if arguments.plot:
        backend = require("matplotlib.pyplot", "plots").get_backend()
        registry = require("matplotlib.backends.registry", "plots")
        if backend in registry.backend_registry.list_builtin(
            registry.BackendFilter.NON_INTERACTIVE
        ):
            raise ValueError(f"--plot has no display to show anything on ({backend}); --save_plot")


def run(arguments: argparse.Namespace) -> int:
    """Score all estimates, print and save; one that cannot be scored does not stop the others."""
    check_outputs_possible(arguments)
    form = FORMATS[arguments.format]
    with collected_warnings() as notes:
        reference = in_order(form.read(arguments.reference, complete=True))
    scored: list[Scored] = []
    failed: list[dict[str, str]] = []
    names = unique_names(arguments.estimates)
    for number, (name, file) in enumerate(zip(names, arguments.estimates, strict=True), 1):
        progress(f"{number}/{len(names)} {name}" if len(names) > 1 else "")
        try:
            scored.append(score(reference, name, file, arguments))
        except ValueError as error:
            failed.append({"file": file, "error": one_line(error, file)})
            fail(failed[-1]["error"])
    progress("")
    units = [one.result.tas.unit for one in scored]
    if scored and max(units) > SAME_UNIT * min(units):
        notes.append(units_note(scored, reference, form))
    else:
        scored.sort(key=lambda one: one.result.score, reverse=True)
    if arguments.json:
        show_json(scored, failed, notes, arguments)
    elif scored:
        show_table(scored, notes, arguments)
    if scored:
        save(scored, arguments)
    return int(bool(failed))


def score(reference: Trajectory, name: str, file: str, arguments: argparse.Namespace) -> Scored:
    """Read, match, check and score one estimate."""
    form = FORMATS[arguments.format]
    timing = {key: getattr(arguments, key) for key in ("t_max_diff", "t_offset") if form.timed}
    with collected_warnings() as file_notes:  # which name the file themselves
        estimate = form.read(file)
    if arguments.invert:
        estimate = estimate._replace(poses=inverse_poses(estimate.poses))
    with collected_warnings() as notes:
        matches = match(reference, estimate, missing=arguments.missing, **timing)
        if len(matches.keys) < min(4, len(reference.keys)):
            options = "".join(f", --{key} {value:g}" for key, value in timing.items())
            raise ValueError(
                f"only {matches.matched} of {len(estimate.keys)} poses could be matched to the "
                f"reference, and it takes 4 (--missing {arguments.missing}{options})"
            )
        convention = find_convention(matches.gt_poses, matches.est_poses)
        inverted = convention.inverted or convention.rotations_inverted  # B is not for these poses
        automatic = arguments.body_rotation == "auto" and not inverted
        body_rotation = convention.body_rotation if automatic else None
        est_poses = matches.est_poses
        if body_rotation is not None:
            est_poses = turn_cameras(est_poses, body_rotation)
        result = pas(
            matches.gt_poses,
            est_poses,
            rng=arguments.seed,
            unit=arguments.unit or derived_unit(matches),
            registration=arguments.registration,
        )
        spread = tas_spread(matches, result, arguments)
    notes += matching_notes(matches, reference, estimate, form)
    if seem_swapped(reference, estimate):
        notes.append(
            "reference and estimate seem swapped: the first file starts at the origin and is the "
            "sparser one, as estimates are; the reference comes first"
        )
    notes += convention_notes(convention, arguments, applied=body_rotation is not None)
    return Scored(
        name=name,
        file=file,
        matches=matches,
        result=result,
        tas_sd=spread,
        ate=ate(matches),
        body_rotation=body_rotation,
        notes=[*file_notes, *(f"{name}: {note}" for note in notes)],
    )


def derived_unit(matches: Matches) -> float:
    """Return d of the reference poses; where there is none, tell what to do."""
    gt = matches.gt_poses[:, :3, 3]
    try:
        return closest_pair_quartile(gt)
    except ValueError:
        reason = (
            f"the reference has {len(gt)} of the 4 poses that it takes"
            if len(gt) < 4
            else "at least three quarters of the reference poses coincide with another one"
        )
        raise ValueError(f"d cannot be derived: {reason}; --unit sets it") from None


def tas_spread(matches: Matches, result: PASResult, arguments: argparse.Namespace) -> float | None:
    """Return the standard deviation of the TAS over the seeds; None for a single one."""
    if arguments.repeat < 2:
        return None
    gt, est = matches.gt_poses[:, :3, 3], matches.est_poses[:, :3, 3]
    seeds = range(arguments.seed + 1, arguments.seed + arguments.repeat)
    options = {"unit": result.tas.unit, "registration": arguments.registration}
    others = [tas(gt, est, rng=seed, **options).score for seed in seeds]
    return float(np.std([result.tas.score, *others], ddof=1))


def ate(matches: Matches) -> float | None:
    """Return the RMSE after the least-squares alignment of the estimated cameras, for context."""
    gt, est = matches.gt_poses[:, :3, 3], matches.est_poses[:, :3, 3]
    estimated = finite_rows(est)
    try:
        errors = Similarity.fit(gt[estimated], est[estimated]).position_errors(
            gt[estimated], est[estimated]
        )
    except ValueError:  # none, or without extent
        return None
    with np.errstate(over="ignore"):
        rmse = float(np.sqrt(np.mean(errors**2)))
    return rmse if math.isfinite(rmse) else None


def matching_notes(
    matches: Matches, reference: Trajectory, estimate: Trajectory, form: Format
) -> list[str]:
    """Tell of poses that were left out, where they are more than few."""
    unmatched, n = matches.unmatched, len(estimate.keys)
    if form.timed:
        notes = []
        if unmatched > n / 10:
            notes.append(f"{unmatched} of {n} poses have no reference pose within --t_max_diff")
        denser = is_denser(reference, matches)
        n_failed = len(matches.keys) - matches.matched  # none of them if they are ignored
        if denser and n_failed:
            notes.append(
                f"{n_failed} of {len(matches.keys)} reference poses count as failures, but the "
                "reference is denser than the estimate: thin it out (evo_traj --downsample)"
            )
        covered = coverage(reference, matches)
        if covered < COVERED:
            note = f"the track covers only {covered:.0%} of the reference, the rest is not scored; "
            note += "--missing fail counts it as failures"
            if denser:
                note += " once the reference is thinned out to the estimate's rate"
            notes.append(note)
        return notes
    if unmatched > 0:
        note = f"{unmatched} of {n} images are not in the reference; left out"
        if matches.missing == 0:
            note += " (it has all of the reference's, too: the reference comes first)"
        return [note]
    return []


def is_denser(reference: Trajectory, matches: Matches) -> bool:
    """Tell whether a reference has stamps so much closer that most poses could have no estimate."""
    estimated = matches.keys[finite_rows(matches.est_poses)]
    if reference.keys.dtype.kind != "f" or len(estimated) < 2:
        return False
    usual, scored = (np.median(np.diff(keys)) for keys in (reference.keys, estimated))
    return bool(scored >= DENSER * usual)


def units_note(scored: Sequence[Scored], reference: Trajectory, form: Format) -> str:
    """Say that scores at different d do not compare, and how to get some that do."""
    units = [one.result.tas.unit for one in scored]
    usual = max(scored, key=lambda one: len(one.matches.keys)).result.tas.unit
    note = (
        f"the scores do not compare and stand in the order given: d is from {min(units):.4g} to "
        f"{max(units):.4g} {form.unit}, as the estimates have other cameras; --unit {usual:.4g} "
        "gives all one d"
    )
    if not any(is_denser(reference, one.matches) for one in scored):
        note += ", --missing fail also the same cameras"
    return note


def convention_notes(
    found: Convention, arguments: argparse.Namespace, *, applied: bool
) -> list[str]:
    """Say in a line each what convention would make the estimate fit, and how to set it."""
    notes = []
    gain = f"RAS {found.ras:.2f} as it is, {found.ras_mended:.2f} so"
    invert = "leave out --invert" if arguments.invert else "add --invert"
    turned = found.body_rotation is not None and (
        "the camera's frame is turned by a constant rotation against the reference's, "
        f"{describe_rotation(found.body_rotation)}"
    )
    if found.inverted:
        now = "camera-to-world, not world-to-camera" if arguments.invert else "world-to-camera"
        extra = f", and {turned}" if turned else ""
        option = f"{invert}, with --body_rotation auto" if turned else invert
        notes.append(f"the poses in the file seem to be {now}{extra} ({gain}); {option}")
    elif found.quaternions_shifted:
        notes.append(
            f"the quaternions seem to have w at the wrong end ({gain}); reorder them in the file"
        )
    elif found.rotations_inverted:
        extra = f", and {turned}" if turned else ""
        notes.append(
            "the rotations seem to be world-to-camera, but the positions are camera centres"
            f"{extra} ({gain}); transpose the rotations in the file"
        )
    elif turned:
        option = "taken out" if applied else "--body_rotation auto takes it out"
        notes.append(f"{turned} ({gain}); {option}")
    if found.mirrored:
        notes.append(
            "the positions fit the mirror image of the reference: one axis is flipped or two are "
            "swapped, as in a left-handed world; no rotation mends that, correct the export"
        )
    return notes


def show_json(
    scored: Sequence[Scored],
    failed: Sequence[dict[str, str]],
    notes: Sequence[str],
    arguments: argparse.Namespace,
) -> None:
    """Print all that was computed, what could not be, and the settings of both."""
    tell(scored, notes)
    printed = {
        "version": __version__,
        "format": arguments.format,
        "reference": arguments.reference,
        "missing_cameras": arguments.missing,
        "t_max_diff": getattr(arguments, "t_max_diff", None),
        "t_offset": getattr(arguments, "t_offset", None),
        "unit": arguments.unit,
        "registration": arguments.registration,
        "seed": arguments.seed,
        "repeat": arguments.repeat,
        "inverted": arguments.invert,
        "body_rotation": arguments.body_rotation,
        "notes": notes,
        "results": [as_json(one) for one in scored],
        "failed": failed,
    }
    print(json.dumps(printed, indent=2, allow_nan=False), flush=True)


def show_table(
    scored: Sequence[Scored], notes: Sequence[str], arguments: argparse.Namespace
) -> None:
    """Print the table, and what there is to note on stderr."""
    tell(scored, notes)
    seeds = f"seed {arguments.seed}"
    if arguments.repeat > 1:
        seeds += f", sd over the {arguments.repeat} seeds from there"
    print(table(scored, FORMATS[arguments.format].unit))
    print(f"registration {arguments.registration}, {seeds}; missing cameras: {arguments.missing}")
    scatter = max(one.tas_sd or 0.0 for one in scored)
    if scatter > SCATTER and arguments.registration != "refined":
        print("the TAS scatters with the seed; --registration refined makes it steadier")
    sys.stdout.flush()


def save(scored: Sequence[Scored], arguments: argparse.Namespace) -> None:
    """Write the files that were asked for, and show the figure."""
    if arguments.save_results:
        save_evo_results(
            scored,
            arguments.save_results,
            names=unique_names(arguments.estimates),
            reference=arguments.reference,
            registration=arguments.registration,
            seed=arguments.seed,
        )
    if not arguments.plot and not arguments.save_plot:
        return
    from .plots import score_figure  # needs Matplotlib

    panels = {one.name: (one.matches, one.result) for one in scored}
    title = f"registration {arguments.registration}, seed {arguments.seed}"
    if arguments.save_plot:
        save_figure(score_figure(panels, title=title), arguments.save_plot)
    if arguments.plot:
        pyplot = require("matplotlib.pyplot", "plots")
        score_figure(panels, title=title, figure=pyplot.figure())
        pyplot.show()


@contextmanager
def collected_warnings() -> Iterator[list[str]]:
    """Collect the library's own warnings as notes; others pass."""
    notes: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        for category in (AlignmentWarning, TrajectoryWarning):
            warnings.simplefilter("always", category)
        try:
            yield notes
        finally:
            others = []
            for one in caught:
                if issubclass(one.category, (AlignmentWarning, TrajectoryWarning)):
                    if str(one.message) not in notes:  # as for each of several seeds
                        notes.append(str(one.message))
                else:
                    others.append(one)
    for one in others:
        warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)


def tell(scored: Sequence[Scored], notes: Sequence[str]) -> None:
    """Print the notes on all and on each estimate on stderr, a line each."""
    for note in [*notes, *(note for one in scored for note in one.notes)]:
        print(f"alignscores: note: {note}", file=sys.stderr)


def one_line(error: Exception, file: str = "") -> str:
    """Return what an error says, in one line; that on a file's content names it already."""
    message = " ".join(str(error).split())
    return f"{file}: {message}" if file and not isinstance(error, FileError) else message


def fail(message: str) -> None:
    """Print an error on stderr."""
    progress("")
    print(f"alignscores: error: {message}", file=sys.stderr)


def progress(text: str) -> None:
    """Show on a terminal how far it is."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
