"""What is saved: errors, aligned estimates, evo results, pictures and the page."""

import argparse
import csv
import math
import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ..trajectories.association import Matches
from ..trajectories.extras import require
from ..trajectories.files import Trajectory
from ..trajectories.formats import FORMATS
from ..validation import finite_rows
from .metrics import OWN, metric_values
from .names import numbered, printable, unique_names
from .scoring import Scored

__all__ = ["LOST", "STATUSES", "save", "show_plot", "statuses", "write_whole"]

STATUSES = "matched", "no rotation", "no position", "no pose", "lost"  # of scored cameras
LOST = STATUSES.index("lost")
LEFT_OUT, NO_REFERENCE = "left out", "no reference pose"


def save(
    scored: Sequence[Scored], reference: Trajectory, arguments: argparse.Namespace
) -> list[tuple[Path, ValueError]]:
    """Write the files that were asked for; return those that could not be written, and why."""
    unsaved = []
    for path, content in files(scored, reference, arguments):
        try:
            if isinstance(content, ValueError):
                raise content
            write_whole(path, content)
        except ValueError as error:
            unsaved.append((path, error))
    return unsaved


def files(
    scored: Sequence[Scored], reference: Trajectory, arguments: argparse.Namespace
) -> Iterator[tuple[Path, bytes | ValueError]]:
    """Yield the files that were asked for, each with its content, or why it has none."""
    names = unique_names(arguments.estimates)
    if path := arguments.save_errors:
        yield path, errors_csv(scored, reference, missing=arguments.missing).encode()
    if path := arguments.save_metrics:
        yield path, metrics_csv(scored, arguments.metrics or list(OWN)).encode()
    if path := arguments.profile:
        yield path, profiles_csv(scored).encode()
    if path := arguments.save_aligned:
        yield from aligned_files(scored, targets(path, names))
    if path := arguments.save_results:
        yield from evo_files(
            scored,
            targets(path, names),
            reference=printable(arguments.reference),
            registration=arguments.registration,
            seed=arguments.seed,
        )
    if path := arguments.save_plot:
        yield path, picture(figure_of(scored, arguments), path)
    if path := arguments.save_page:
        from .page import page  # it imports this module in turn

        yield path, page(scored, reference, arguments).encode()


def show_plot(scored: Sequence[Scored], arguments: argparse.Namespace) -> None:
    """Show the figure in a window."""
    pyplot = require("matplotlib.pyplot", "plots")
    figure_of(scored, arguments, figure=pyplot.figure())
    pyplot.show()


def figure_of(
    scored: Sequence[Scored], arguments: argparse.Namespace, *, figure: Any = None
) -> Any:
    """Draw the estimates, into a figure of pyplot's if one is given."""
    from .plots import score_figure  # needs Matplotlib

    unit = FORMATS[arguments.format].unit
    title = f"registration {arguments.registration}, seed {arguments.seed}"
    return score_figure(scored, unit=unit, title=title, figure=figure)


def errors_csv(scored: Sequence[Scored], reference: Trajectory, *, missing: str | None) -> str:
    """Return a table of each estimate's errors, a line a camera, with what became of it.

    Those that were scored have errors, infinite ones for failures. Besides there are due frames
    without a reference pose and, where missing cameras are left out, these.
    """
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("estimate", "camera", "position_error", "rotation_error_deg", "status"))
    for one in scored:
        matches, result = one.matches, one.result
        rows = [
            (key, *errors, STATUSES[status])
            for key, *errors, status in zip(
                matches.keys.tolist(),
                result.tas.errors.tolist(),
                result.ras.errors.tolist(),
                statuses(matches).tolist(),
                strict=True,
            )
        ]
        rows += [(key, "", "", NO_REFERENCE) for key in matches.without_reference.tolist()]
        if missing != "fail":  # else what was not scored was not due
            left_out = reference.keys[~np.isin(reference.keys, matches.keys)]
            rows += [(key, "", "", LEFT_OUT) for key in left_out.tolist()]
        writer.writerows((one.name, *row) for row in sorted(rows, key=lambda row: row[0]))
    return text.getvalue()


def metrics_csv(scored: Sequence[Scored], names: Sequence[str]) -> str:
    """Return a table of metrics, a line an estimate; empty where there is no value."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("estimate", *names))
    writer.writerows((one.name, *metric_values(one, names).values()) for one in scored)
    return text.getvalue()


def profiles_csv(scored: Sequence[Scored]) -> str:
    """Return a table of each estimate's scores over all units, a line a score and unit."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("estimate", "score", "unit", "value"))
    for one in scored:
        assert one.profiles is not None
        for name, units, values in (
            ("TAS", one.profiles.units, one.profiles.tas),
            ("RAS", one.profiles.degrees, one.profiles.ras),
        ):
            pairs = zip(units.tolist(), values.tolist(), strict=True)
            writer.writerows((one.name, name, *pair) for pair in pairs)
    return text.getvalue()


def statuses(matches: Matches) -> NDArray[np.uint8]:
    """Tell of each scored camera whether it was matched, or why it is a failure: in `STATUSES`."""
    poses = matches.est_poses
    no_position, no_rotation = ~finite_rows(poses[:, :3, 3]), ~finite_rows(poses[:, :3, :3])
    codes = np.where(matches.est_rows < 0, LOST, 2 * no_position + no_rotation)
    return codes.astype(np.uint8)


def aligned_files(
    scored: Sequence[Scored], files: Mapping[str, tuple[Path, str]]
) -> Iterator[tuple[Path, bytes | ValueError]]:
    """Yield estimates in the reference's world, with its time stamps: as TUM, or KITTI without.

    They have all their poses, whether they were matched or not, aligned as in the TAS. `files` are
    as of `targets`.
    """
    for one in scored:
        target, _ = files[one.name]
        alignment = one.result.tas.alignment
        if alignment is None:
            yield target, ValueError(f"is not written, since {one.name} could not be aligned")
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
        yield target, buffer.getvalue()


def targets(path: Path, names: Sequence[str]) -> dict[str, tuple[Path, str]]:
    """Return the file of each estimate, and its name without a slash.

    A single estimate goes to `path`. Of several, each goes to the path with its name appended;
    `names` are those of all estimates, also of those that could not be scored.
    """
    flat = numbered([name.replace("/", "_") for name in names])
    files = [path.with_name(f"{path.stem}_{name}{path.suffix}") for name in flat]
    return dict(zip(names, zip(files if names[1:] else [path], flat, strict=True), strict=True))


def evo_files(
    scored: Sequence[Scored],
    files: Mapping[str, tuple[Path, str]],
    *,
    reference: str,
    registration: str,
    seed: int,
) -> Iterator[tuple[Path, bytes]]:
    """Yield results that ``evo_res`` reads, one file an estimate; `files` are as of `targets`.

    evo's statistics are of the share of the thresholds that a pose misses, from 0 to 1, whose mean
    is 1 - PAS.
    """
    file_interface = require("evo.tools.file_interface", "evo")
    from ..trajectories.evo import PAS  # needs evo

    for one in scored:
        target, flat_name = files[one.name]
        result = PAS.of(one.result).get_result(reference, flat_name)
        result.add_info(
            {
                "title": f"PAS: share of the thresholds missed ({registration}, seed {seed})",
                "label": "share of the thresholds missed",
                "registration": registration,
                "seed": seed,
            }
        )
        extra = {
            "ATE": one.ate,
            "TAS_sd": one.tas_sd,
            "half_distance": one.half_distance,
            "half_angle": one.half_angle,
        }
        known = {key: value for key, value in extra.items() if value not in (None, math.inf)}
        result.add_stats(known)
        if one.matches.keys.dtype.kind == "f":
            result.add_np_array("timestamps", one.matches.keys)
        buffer = BytesIO()
        file_interface.save_res_file(buffer, result)
        yield target, buffer.getvalue()


def picture(figure: Any, path: Path) -> bytes:
    """Return a figure in the format that the name of its file tells."""
    buffer = BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # a name in a script that the font has not
        figure.savefig(buffer, format=path.suffix.removeprefix("."), dpi=200)
    return buffer.getvalue()


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a temporary name, then rename it: nobody ever sees half of it."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    except OSError as error:  # named after the file, not after the temporary one
        raise ValueError(f"cannot be written ({error.strerror})") from None
    finally:
        temporary.unlink(missing_ok=True)
