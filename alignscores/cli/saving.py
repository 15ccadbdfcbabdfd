"""What is saved: errors, aligned estimates, evo results and pictures."""

import argparse
import csv
import os
import warnings
from collections.abc import Sequence
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from ..trajectories.extras import require
from ..trajectories.files import Trajectory
from ..validation import finite_rows
from .names import numbered, printable, unique_names
from .output import print_error
from .scoring import Scored

__all__ = ["save"]

STATUS = {  # whether there are a position and a rotation -> what is said of the camera
    (True, True): "matched",
    (True, False): "no rotation",
    (False, True): "no position",
    (False, False): "no pose",
}


def save(scored: Sequence[Scored], reference: Trajectory, arguments: argparse.Namespace) -> None:
    """Write the files that were asked for, and show the figure."""
    names = unique_names(arguments.estimates)
    if arguments.save_errors:
        write_whole(arguments.save_errors, errors_csv(scored, reference).encode())
    if arguments.save_aligned:
        save_aligned(scored, arguments.save_aligned, names=names)
    if arguments.save_results:
        save_evo_results(
            scored,
            arguments.save_results,
            names=names,
            reference=printable(arguments.reference),
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


def errors_csv(scored: Sequence[Scored], reference: Trajectory) -> str:
    """Return a table of each estimate's errors, a line a camera.

    Reference poses that were left out of the scores have no errors, failures infinite ones.
    """
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("estimate", "camera", "position_error", "rotation_error_deg", "status"))
    for one in scored:
        left_out = reference.keys[~np.isin(reference.keys, one.matches.keys)]
        poses, result = one.matches.est_poses, one.result
        kinds = zip(finite_rows(poses[:, :3, 3]), finite_rows(poses[:, :3, :3]), strict=True)
        errors = zip(result.tas.errors.tolist(), result.ras.errors.tolist(), strict=True)
        rows = [
            (key, *both, STATUS[bool(position), bool(rotation)])
            for key, both, (position, rotation) in zip(
                one.matches.keys.tolist(), errors, kinds, strict=True
            )
        ]
        rows += [(key, "", "", "not estimated") for key in left_out.tolist()]
        writer.writerows((one.name, *row) for row in sorted(rows, key=lambda row: row[0]))
    return text.getvalue()


def save_aligned(scored: Sequence[Scored], path: Path, *, names: Sequence[str]) -> None:
    """Save estimates in the reference's world, with its time stamps: as TUM, or KITTI without.

    All their poses are saved, whether they were matched or not, aligned as in the TAS. See
    `targets` for the names of the files.
    """
    for one in scored:
        target, _ = targets(path, names)[one.name]
        alignment = one.result.tas.alignment
        if alignment is None:
            print_error(f"{one.name}: could not be aligned, so {target} is not written")
            continue
        to_reference = alignment.inverse()
        keys, poses = one.estimate
        positions = to_reference.apply(poses[:, :3, 3])
        rotations = to_reference.rotation @ poses[:, :3, :3]
        if keys.dtype.kind == "f":
            quaternions = np.full((len(poses), 4), np.nan)
            finite = finite_rows(rotations)
            quaternions[finite] = scipy.spatial.transform.Rotation.from_matrix(
                rotations[finite]
            ).as_quat()
            columns = [keys, positions, quaternions]
        else:
            columns = [np.dstack([rotations, positions]).reshape(-1, 12)]
        buffer = BytesIO()
        np.savetxt(buffer, np.column_stack(columns), fmt="%.16g")
        write_whole(target, buffer.getvalue())


def targets(path: Path, names: Sequence[str]) -> dict[str, tuple[Path, str]]:
    """Return the file of each estimate, and its name without a slash.

    A single estimate goes to `path`. Of several, each goes to the path with its name appended;
    `names` are those of all estimates, also of those that could not be scored.
    """
    flat = numbered([name.replace("/", "_") for name in names])
    files = [path.with_name(f"{path.stem}_{name}{path.suffix}") for name in flat]
    return dict(zip(names, zip(files if names[1:] else [path], flat, strict=True), strict=True))


def save_evo_results(
    scored: Sequence[Scored],
    path: Path,
    *,
    names: Sequence[str],
    reference: str,
    registration: str,
    seed: int,
) -> list[Path]:
    """Save results that ``evo_res`` reads, one file an estimate.

    See `targets` for the names of the files. evo's statistics are of the share of the thresholds
    that a pose misses, from 0 to 1, whose mean is 1 - PAS.

    Returns
    -------
    list of Path
        The files.
    """
    file_interface = require("evo.tools.file_interface", "files")
    from ..trajectories.evo import PAS  # needs evo

    files: dict[Path, bytes] = {}
    for one in scored:
        target, flat_name = targets(path, names)[one.name]
        result = PAS.of(one.result).get_result(reference, flat_name)
        result.add_info(
            {
                "title": f"PAS: share of the thresholds missed ({registration}, seed {seed})",
                "label": "share of the thresholds missed",
                "registration": registration,
                "seed": seed,
            }
        )
        extra = {"ATE": one.ate, "TAS_sd": one.tas_sd}
        result.add_stats({key: value for key, value in extra.items() if value is not None})
        if one.matches.keys.dtype.kind == "f":
            result.add_np_array("timestamps", one.matches.keys)
        buffer = BytesIO()
        file_interface.save_res_file(buffer, result)
        files[target] = buffer.getvalue()
    for file, content in files.items():
        write_whole(file, content)
    return list(files)


def save_figure(figure: Any, path: Path) -> None:
    """Save a figure, whole or not at all."""
    buffer = BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # a name in a script that the font has not
        figure.savefig(buffer, format=path.suffix.removeprefix("."), dpi=200)
    write_whole(path, buffer.getvalue())


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a temporary name, then rename it: nobody ever sees half of it."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    except OSError as error:  # named after the file, not after the temporary one
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        temporary.unlink(missing_ok=True)
