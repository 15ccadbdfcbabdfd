"""Files that are saved, an option each; and all of them in a folder."""

import argparse
import math
import re
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
from ..show import tables
from ..show.evo import evo_result
from ..texts import numbered, printable
from ..validation import finite_rows
from ..writing import write_whole
from .output import Results, print_note

__all__ = ["KINDS", "PRINTED", "STDOUT", "outputs", "refuse_to_replace", "save"]


class Kind(NamedTuple):
    """What an option saves."""

    suffixes: tuple[str, ...]
    help: str
    default: str = ""  # its file in the folder of --output
    each: bool = False  # a file an estimate
    packages: tuple[str, ...] = ()  # that it needs
    extra: str = ""  # which installs them


KINDS = {
    "save_plot": Kind(
        (".png", ".pdf", ".svg"), "save the plot", "plot.png", False, ("matplotlib",), "plots"
    ),
    "save_page": Kind(
        (".html",),
        "save a page with trajectories, errors and scores",
        "page.html",
        packages=("plotly", "jinja2"),
        extra="page",
    ),
    "save_rrd": Kind(
        (".rrd",), "save a recording for the Rerun viewer", packages=("rerun",), extra="rerun"
    ),
    "save_errors": Kind(
        (".csv",),
        "save the errors of each expected frame",
        "errors.csv",
        False,
        ("pandas",),
        "tables",
    ),
    "save_csv": Kind(
        (".csv",), "save what --csv prints", "scores.csv", False, ("pandas",), "tables"
    ),
    "markdown": Kind(
        (),
        "save the table in Markdown, with all notes; - prints it",
        "scores.md",
        False,
        ("pandas", "tabulate"),
        "tables",
    ),
    "latex": Kind(
        (), "print the table in LaTeX", "scores.tex", False, ("pandas", "jinja2"), "tables"
    ),
    "save_aligned": Kind(
        (".txt",), "save the aligned estimate, as TUM or KITTI", "aligned.txt", each=True
    ),
    "save_results": Kind(
        (".zip",), "save results for evo_res", each=True, packages=("evo",), extra="evo"
    ),
    # The last, since it has what could not be written.
    "save_json": Kind((".json",), "save what --json prints", "scores.json"),
}
PRINTED = {"json": "JSON", "csv": "CSV", "latex": "LaTeX"}  # instead of the table
STDOUT = Path("-")


Output = tuple[str, Path, str | None]  # its option, and the estimate that it is of, if it is of one


def outputs(
    arguments: argparse.Namespace, names: Sequence[str], settings: Settings
) -> list[Output]:
    """Return all files that will be written, whose packages are there."""
    written: list[Output] = []
    for option, kind in KINDS.items():
        path = getattr(arguments, option, None)
        if path in (None, STDOUT) and arguments.output and _is_possible(kind, option, settings):
            path = arguments.output / kind.default
        if path in (None, STDOUT):
            continue
        for package in kind.packages:
            require(package, kind.extra)
        files = _of_each(path, names) if kind.each else {None: path}
        written += [(option, file, name) for name, file in files.items()]
    return written


def _is_possible(kind: Kind, option: str, settings: Settings) -> bool:
    """Return whether a file of --output can be written."""
    missing = [package for package in kind.packages if find_spec(package) is None]
    if kind.default and missing:
        install = f'pip install "alignscores[{kind.extra}]"'
        print_note(f"{kind.default} is not written: {missing[0]} is not installed: {install}")
    ordered = option != "save_aligned" or settings.form.ordered
    return bool(kind.default) and not missing and ordered


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


def save(outputs: Sequence[Output], results: Results, arguments: argparse.Namespace) -> None:
    """Write the files; those that cannot be written are failures."""
    for option, path, name in outputs:
        scored = [one for one in results.scored if name in (None, one.name)]
        if not scored and option != "save_json":  # the estimate could not be scored
            continue
        try:
            write_whole(path, _content(option, scored, results, path, arguments))
        except ValueError as error:
            results.fail(str(path), error)


def _content(
    option: str,
    scored: Sequence[Evaluation],
    results: Results,
    path: Path,
    arguments: argparse.Namespace,
) -> bytes:
    """Return what an option writes of some estimates."""
    reference = printable(results.reference)
    match option:
        case "save_errors":
            return errors_csv(scored).encode()
        case "save_aligned":
            return aligned(scored[0])
        case "save_results":
            return evo_result(scored[0], reference, arguments.pose_relation)
        case "save_plot":
            from ..show.plots import figure_of, picture  # needs Matplotlib

            return picture(figure_of(scored, plot_mode=arguments.plot_mode), path.suffix)
        case "save_rrd":
            from ..show.rerun import recording  # needs Rerun

            return recording(scored)
        case "save_page":
            from ..show.page import page_of  # needs plotly

            return page_of(scored, reference, results.all_notes()).encode()
        case _:
            return results.written(option.removeprefix("save_")).encode()


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
        without = matches.without_reference.tolist()
        rows += [(key, math.nan, math.nan, "no reference pose") for key in without]
        if evaluation.settings.missing != "fail":
            keys = evaluation.reference.keys[matches.expected_rows]
            left_out = keys[~np.isin(keys, matches.keys)].tolist()
            rows += [(key, math.nan, math.nan, "left out") for key in left_out]
        lines += [(evaluation.name, *row) for row in sorted(rows, key=lambda row: row[0])]
    columns = ["estimate", "camera", "position_error", "rotation_error_deg", "status"]
    return tables.as_csv(require("pandas", "tables").DataFrame(lines, columns=columns))


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
