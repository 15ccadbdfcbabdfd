"""Files that are saved, an option each; and all of them in a folder."""

import argparse
import re
import warnings
from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from io import BytesIO
from os.path import realpath
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy

from ..evaluation.evaluation import STATUSES, Evaluation
from ..evaluation.reading import files_below
from ..evaluation.settings import Settings
from ..extras import require
from ..metrics import SCORES
from ..metrics.paths import STATISTICS
from ..pages.estimates import page
from ..texts import csv_text, numbered, printable
from ..validation import finite_rows
from ..writing import write_whole
from .output import Results, print_note

__all__ = ["KINDS", "outputs", "refuse_to_replace", "save"]


class Kind(NamedTuple):
    """What an option saves."""

    suffixes: tuple[str, ...]
    help: str
    default: str = ""  # its file in the folder of --output
    each: bool = False  # a file an estimate
    needs: tuple[str, ...] = ()  # a package, and the extra that installs it


KINDS = {
    "save_plot": Kind(
        (".png", ".pdf", ".svg"), "save the plot", "plot.png", needs=("matplotlib", "plots")
    ),
    "save_page": Kind((".html",), "save a page with trajectories, errors and scores", "page.html"),
    "save_rrd": Kind((".rrd",), "save a recording for the Rerun viewer", needs=("rerun", "rerun")),
    "save_errors": Kind((".csv",), "save the errors of each expected frame", "errors.csv"),
    "save_metrics": Kind((".csv",), "save --metrics or, without it, the scores", "metrics.csv"),
    "save_aligned": Kind(
        (".txt",), "save the aligned estimate, as TUM or KITTI", "aligned.txt", each=True
    ),
    "save_results": Kind((".zip",), "save results for evo_res", each=True, needs=("evo", "evo")),
    # The last, since it has what could not be written.
    "save_json": Kind((".json",), "save what --json prints", "scores.json"),
}


Output = tuple[str, Path, str | None]  # its option, and the estimate that it is of, if it is of one


def outputs(
    arguments: argparse.Namespace, names: Sequence[str], settings: Settings
) -> list[Output]:
    """Return all files that will be written, whose packages are there."""
    written: list[Output] = []
    for option, kind in KINDS.items():
        path = getattr(arguments, option)
        if path is None and arguments.output and kind.default and _is_possible(option, settings):
            path = arguments.output / kind.default
        if path is None:
            continue
        if kind.needs:
            require(*kind.needs)
        files = _of_each(path, names) if kind.each else {None: path}
        written += [(option, file, name) for name, file in files.items()]
    return written


def _is_possible(option: str, settings: Settings) -> bool:
    """Return whether a file of --output can be written."""
    if option == "save_plot" and find_spec("matplotlib") is None:
        print_note("plot.png is not written: Matplotlib is not installed")
        return False
    return option != "save_aligned" or settings.form.ordered


def _of_each(path: Path, names: Sequence[str]) -> dict[str | None, Path]:
    """Return the file of each estimate: of several each has its name, without slashes, appended."""
    if len(names) == 1:
        return {names[0]: path}
    suffix = r"\.[a-z]+(?=$| \()"  # not of v1.2, and before the number of equal names
    short = numbered([re.sub(suffix, "", name.replace("/", "_")) for name in names])
    files = (path.with_name(f"{path.stem}_{own}{path.suffix}") for own in short)
    return dict(zip(names, files, strict=True))


def refuse_to_replace(inputs: Iterable[str], outputs: Iterable[tuple[str, Path]]) -> None:
    """Check that no output, by option, replaces an input or another output."""
    used = {realpath(file): f"the input {file}" for path in inputs for file in files_below(path)}
    for option, path in outputs:
        target = realpath(path)  # unlike `Path.resolve`, also of a link to itself
        if target in used:
            raise ValueError(f"--{option} {path} would replace {used[target]}; name another")
        used[target] = f"what --{option} writes"


def save(outputs: Sequence[Output], results: Results, plot_mode: str | None) -> None:
    """Write the files; those that cannot be written are failures."""
    reference = printable(results.reference)
    for option, path, name in outputs:
        scored = [one for one in results.scored if name in (None, one.name)]
        if not scored and option != "save_json":  # the estimate could not be scored
            continue
        try:
            match option:
                case "save_errors":
                    content = errors_csv(scored).encode()
                case "save_metrics":
                    content = metrics_csv(scored).encode()
                case "save_aligned":
                    content = aligned(scored[0])
                case "save_results":
                    content = evo_result(scored[0], reference)
                case "save_plot":
                    content = picture(scored, plot_mode, path)
                case "save_rrd":
                    from ..rerun import recording  # needs Rerun

                    content = recording(scored)
                case "save_page":
                    content = page(scored, reference).encode()
                case "save_json":
                    content = results.json().encode()
            write_whole(path, content)
        except ValueError as error:
            results.fail(str(path), error)


def errors_csv(scored: Sequence[Evaluation]) -> str:
    """Return a table of the errors of each expected frame, with a status.

    Frames that are left out, or have no reference pose, have no errors.
    """
    lines: list[tuple[object, ...]] = []
    for evaluation in scored:
        matches, result = evaluation.matches, evaluation.result
        statuses = [STATUSES[status] for status in evaluation.statuses]
        errors = result.tas.errors.tolist(), result.ras.errors.tolist()
        rows = list(zip(matches.keys.tolist(), *errors, statuses, strict=True))
        rows += [(key, "", "", "no reference pose") for key in matches.without_reference.tolist()]
        if evaluation.settings.missing != "fail":
            keys = evaluation.reference.keys[matches.expected_rows]
            left_out = keys[~np.isin(keys, matches.keys)]
            rows += [(key, "", "", "left out") for key in left_out.tolist()]
        lines += [(evaluation.name, *row) for row in sorted(rows, key=lambda row: row[0])]
    return csv_text(("estimate", "camera", "position_error", "rotation_error_deg", "status"), lines)


def metrics_csv(scored: Sequence[Evaluation]) -> str:
    """Return a table of metrics, a line an estimate; empty where there is no value."""
    names = scored[0].settings.metrics or SCORES
    lines = [(one.name, *map(one.value, names)) for one in scored]
    return csv_text(("estimate", *names), lines)


def aligned(evaluation: Evaluation) -> bytes:
    """Return an estimate in the reference's frame, with its time stamps: as TUM, or KITTI without.

    It has all its poses, whether they were matched or not, aligned as in the TAS.
    """
    alignment = evaluation.result.tas.alignment
    if alignment is None:
        raise ValueError(f"is not written, since {evaluation.name} could not be aligned")
    keys, poses = evaluation.estimate
    to_reference = alignment.inverse()
    positions = to_reference.apply(poses[:, :3, 3])
    rotations = to_reference.rotation @ poses[:, :3, :3]
    if keys.dtype.kind == "f":
        quaternions = np.full((len(poses), 4), np.nan)
        finite = finite_rows(rotations)
        of_matrix = scipy.spatial.transform.Rotation.from_matrix
        quaternions[finite] = of_matrix(rotations[finite]).as_quat()
        columns = [keys, positions, quaternions]
    else:
        columns = [np.dstack([rotations, positions]).reshape(-1, 12)]
    buffer = BytesIO()
    np.savetxt(buffer, np.column_stack(columns), fmt="%.16g")
    return buffer.getvalue()


def evo_result(evaluation: Evaluation, reference: str) -> bytes:
    """Return a result for ``evo_res``: the scores, and the position errors of tracked frames."""
    file_interface = require("evo.tools.file_interface", "evo")
    result = require("evo.core.result", "evo").Result()
    settings, errors = evaluation.settings, evaluation.result.tas.errors
    tracked = np.isfinite(errors)
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
        result.stats |= {name: float(of(errors[tracked])) for name, of in STATISTICS.items()}
    result.np_arrays = {"error_array": errors[tracked]}
    if evaluation.matches.keys.dtype.kind == "f":
        result.np_arrays["timestamps"] = evaluation.matches.keys[tracked]
    buffer = BytesIO()
    file_interface.save_res_file(buffer, result)
    return buffer.getvalue()


def picture(scored: Sequence[Evaluation], plot_mode: str | None, path: Path) -> bytes:
    """Return the figure in the format of the file's suffix."""
    from ..plots import figure_of  # needs Matplotlib

    buffer = BytesIO()
    figure = figure_of(scored, plot_mode=plot_mode)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # of names in letters that the font lacks
        figure.savefig(buffer, format=path.suffix.removeprefix("."), dpi=200)
    return buffer.getvalue()
