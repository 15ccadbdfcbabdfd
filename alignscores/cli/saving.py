"""What is saved: errors, aligned estimates, evo results, pictures and the page."""

import argparse
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from ..evaluation.evaluation import STATUSES, Evaluation
from ..evaluation.reading import files_below
from ..metrics import SCORES
from ..pages.estimates import page
from ..protocols.trajectory import STATISTICS
from ..texts import csv_text, numbered, printable, unique_names
from ..trajectories.extras import require
from ..validation import finite_rows
from ..writing import write_whole
from .output import json_text, one_line, print_error

__all__ = ["refuse_to_replace", "save", "show_plot", "targets"]


def refuse_to_replace(inputs: Iterable[str], outputs: Iterable[tuple[str, Path]]) -> None:
    """Check that no output, by option, replaces an input or another output."""
    used = {file.resolve(): f"the input {file}" for path in inputs for file in files_below(path)}
    for option, path in outputs:
        target = path.resolve()
        if target in used:
            raise ValueError(f"{option} {path} would replace {used[target]}; name another")
        used[target] = f"what {option} writes"


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
        if evaluation.settings.missing != "fail":
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


def aligned_files(
    scored: Sequence[Evaluation], files: Mapping[str, Path]
) -> Iterator[tuple[Path, bytes | ValueError]]:
    """Yield estimates in the reference's frame, with its time stamps: as TUM, or KITTI without.

    They have all their poses, whether they were matched or not, aligned as in the TAS.
    """
    for evaluation in scored:
        target = files[evaluation.name]
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


def targets(path: Path, names: Sequence[str]) -> dict[str, Path]:
    """Return the file of each estimate: of several each has its name, without slashes, appended.

    A suffix that all names share is left out; `names` has also those that were not scored.
    """
    if len(names) == 1:
        return {names[0]: path}
    flat = [Path(name.replace("/", "_")) for name in names]
    same = len({name.suffix for name in flat}) == 1
    short = numbered([name.stem if same else name.name for name in flat])
    return {
        name: path.with_name(f"{path.stem}_{own}{path.suffix}")
        for name, own in zip(names, short, strict=True)
    }


def evo_files(
    scored: Sequence[Evaluation], files: Mapping[str, Path], *, reference: str
) -> Iterator[tuple[Path, bytes]]:
    """Yield results for ``evo_res``: the scores, and the position errors of tracked frames."""
    file_interface = require("evo.tools.file_interface", "evo")
    new_result = require("evo.core.result", "evo").Result

    for evaluation in scored:
        target = files[evaluation.name]
        tas, settings = evaluation.result.tas, evaluation.settings
        tracked = np.isfinite(tas.errors)
        result = new_result()
        result.info = {
            "title": f"position error of tracked frames ({settings.how_aligned})",
            "label": f"position error ({settings.form.unit})",
            "ref_name": reference,
            "est_name": evaluation.name.replace("/", "_"),
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
