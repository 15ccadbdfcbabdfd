"""What is saved: errors, aligned estimates, evo results, pictures and the page."""

import argparse
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from ..evaluation.evaluation import STATUSES, Evaluation
from ..evaluation.matching import files_below
from ..metrics import SCORES
from ..pages.estimates import page
from ..protocols.trajectory import STATISTICS
from ..texts import csv_text, numbered, printable, unique_names
from ..trajectories.extras import require
from ..validation import finite_rows
from ..writing import check_target, write_whole
from .output import json_text, one_line, print_error

__all__ = ["refuse_to_replace", "save", "show_plot", "targets"]

Targets = Mapping[str, tuple[Path, str]]  # as of `targets`


def refuse_to_replace(inputs: Iterable[str], outputs: Iterable[tuple[str, Path]]) -> None:
    """Check that the outputs, by option, can be written and replace no input or other output."""
    files = [file for path in inputs for file in files_below(path)]
    input_of = {_identity(file): file for file in files}
    used: dict[Path, str] = {}
    for option, path in outputs:
        try:
            with suppress(IsADirectoryError):  # an error at the end, after the others are saved
                check_target(path)
        except OSError as error:
            raise ValueError(f"{option} {path} cannot be written ({error.strerror})") from None
        identity = _identity(path)
        if identity and (replaced := input_of.get(identity)):
            raise ValueError(f"{option} {path} would replace the input {replaced}; name another")
        target = path.parent.resolve() / path.name
        if target in used:
            raise ValueError(f"{option} and {used[target]} would both write {path}")
        used[target] = option


def _identity(path: Path) -> tuple[int, int] | None:
    """Return what all paths and links of one file have in common; None where there is no file."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino


def save(
    scored: Sequence[Evaluation],
    failed: Sequence[dict[str, str]],
    notes: Sequence[str],
    arguments: argparse.Namespace,
) -> list[dict[str, str]]:
    """Write the files that were asked for; print and return those that could not be written."""
    unsaved = []
    for path, content in files(scored, arguments):
        try:
            if isinstance(content, ValueError):
                raise content
            write_whole(path, content)
        except ValueError as error:
            unsaved.append({"file": printable(str(path)), "error": one_line(error, str(path))})
            print_error(unsaved[-1]["error"])
    if path := arguments.save_json:
        settings = scored[0].settings
        text = json_text(settings, arguments.reference, scored, [*failed, *unsaved], notes)
        write_whole(path, text.encode())
    return unsaved


def files(
    scored: Sequence[Evaluation], arguments: argparse.Namespace
) -> Iterator[tuple[Path, bytes | ValueError]]:
    """Yield the files that were asked for, each with its content, or why it has none."""
    names, settings = unique_names(arguments.estimates), scored[0].settings
    file = printable(arguments.reference)
    if path := arguments.save_errors:
        yield path, errors_csv(scored).encode()
    if path := arguments.save_metrics:
        metrics = settings.metrics or [family.example for family in SCORES]
        yield path, metrics_csv(scored, metrics).encode()
    if path := arguments.profile:
        yield path, profiles_csv(scored).encode()
    if path := arguments.save_aligned:
        yield from aligned_files(scored, targets(path, names))
    if path := arguments.save_results:
        yield from evo_files(scored, targets(path, names), reference=file)
    if path := arguments.save_plot:
        yield path, picture(scored, arguments.plot_mode, path)
    if path := arguments.save_rrd:
        from ..rerun import recording  # needs Rerun

        yield path, recording(scored)
    if path := arguments.save_page:
        yield path, page(scored, file).encode()


def show_plot(scored: Sequence[Evaluation], plot_mode: str | None) -> None:
    """Show the figure in a window."""
    from ..plots import figure_of  # needs Matplotlib

    figure_of(scored, plot_mode=plot_mode, interactive=True)
    require("matplotlib.pyplot", "plots").show()


def errors_csv(scored: Sequence[Evaluation]) -> str:
    """Return a table of the errors of each expected frame, with a status.

    Frames that are left out, or have no reference pose, have no errors.
    """
    lines: list[tuple[object, ...]] = []
    for evaluation in scored:
        matches, result = evaluation.matches, evaluation.result
        rows: list[tuple[Any, ...]] = [
            (key, *errors, STATUSES[status])
            for key, *errors, status in zip(
                matches.keys.tolist(),
                result.tas.errors.tolist(),
                result.ras.errors.tolist(),
                evaluation.statuses.tolist(),
                strict=True,
            )
        ]
        rows += [(key, "", "", "no reference pose") for key in matches.without_reference.tolist()]
        if evaluation.settings.missing_cameras != "fail":
            keys = evaluation.reference.keys[matches.expected_rows]
            left_out = keys[~np.isin(keys, matches.keys)]
            rows += [(key, "", "", "left out") for key in left_out.tolist()]
        lines += [(evaluation.name, *row) for row in sorted(rows, key=lambda row: row[0])]
    return csv_text(("estimate", "camera", "position_error", "rotation_error_deg", "status"), lines)


def metrics_csv(scored: Sequence[Evaluation], names: Sequence[str]) -> str:
    """Return a table of metrics, a line an estimate; empty where there is no value."""
    lines = [
        (evaluation.name, *(evaluation.value(name) for name in names)) for evaluation in scored
    ]
    return csv_text(("estimate", *names), lines)


def profiles_csv(scored: Sequence[Evaluation]) -> str:
    """Return a table of each estimate's scores over all units, a line a score and unit."""
    lines: list[tuple[object, ...]] = []
    for evaluation in scored:
        for name, profile in zip(("TAS", "RAS"), evaluation.profiles, strict=True):
            pairs = zip(profile.units.tolist(), profile.scores.tolist(), strict=True)
            lines += [(evaluation.name, name, *pair) for pair in pairs]
    return csv_text(("estimate", "score", "unit", "value"), lines)


def aligned_files(
    scored: Sequence[Evaluation], files: Targets
) -> Iterator[tuple[Path, bytes | ValueError]]:
    """Yield estimates in the reference's frame, with its time stamps: as TUM, or KITTI without.

    They have all their poses, whether they were matched or not, aligned as in the TAS.
    """
    for evaluation in scored:
        target, _ = files[evaluation.name]
        alignment = evaluation.result.tas.alignment
        if alignment is None:
            reason = f"is not written, since {evaluation.name} could not be aligned"
            yield target, ValueError(reason)
            continue
        to_reference = alignment.inverse()
        keys, poses = evaluation.estimate
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

    Of several estimates each has its name appended, without a suffix that all share; `names` has
    also those that were not scored.
    """
    flat = [name.replace("/", "_") for name in names]
    endings = {Path(name).suffix for name in flat}
    short = numbered([Path(name).stem for name in flat] if len(endings) == 1 else flat)
    files = [path.with_name(f"{path.stem}_{name}{path.suffix}") for name in short]
    return dict(zip(names, zip(files if names[1:] else [path], flat, strict=True), strict=True))


def evo_files(
    scored: Sequence[Evaluation], files: Targets, *, reference: str
) -> Iterator[tuple[Path, bytes]]:
    """Yield results for ``evo_res``: the scores, and the position errors of tracked frames."""
    file_interface = require("evo.tools.file_interface", "evo")
    new_result = require("evo.core.result", "evo").Result

    for evaluation in scored:
        target, flat_name = files[evaluation.name]
        tas, settings = evaluation.result.tas, evaluation.settings
        tracked = np.isfinite(tas.errors)
        result = new_result()
        result.info = {
            "title": f"position error of tracked frames ({settings.how_aligned})",
            "label": f"position error ({settings.form.unit})",
            "ref_name": reference,
            "est_name": flat_name,
        }
        names = "TAS", "RAS", "PAS", "half_distance", "half_angle", "ATE"
        values = {name: evaluation.value(name) for name in names}
        result.stats = {name: value for name, value in values.items() if value is not None}
        if tracked.any():
            result.stats |= {
                name: float(of(tas.errors[tracked])) for name, of in STATISTICS.items()
            }
        result.np_arrays = {"error_array": tas.errors[tracked]}
        if evaluation.matches.keys.dtype.kind == "f":
            result.np_arrays["timestamps"] = evaluation.matches.keys[tracked]
        buffer = BytesIO()
        file_interface.save_res_file(buffer, result)
        yield target, buffer.getvalue()


def picture(scored: Sequence[Evaluation], plot_mode: str | None, path: Path) -> bytes:
    """Return the figure in the format of the file's suffix."""
    from ..plots import figure_of  # needs Matplotlib

    buffer = BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # a name in a script that the font has not
        figure = figure_of(scored, plot_mode=plot_mode)
        figure.savefig(buffer, format=path.suffix.removeprefix("."), dpi=200)
    return buffer.getvalue()
