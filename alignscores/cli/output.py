"""What is told about scored estimates: a table, JSON, evo results and pictures."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..pose import PASResult
from ..trajectories.association import Matches
from ..trajectories.extras import require

__all__ = ["Scored", "as_json", "save_evo_results", "save_figure", "table", "unique_names"]


@dataclass(frozen=True, eq=False)
class Scored:
    """An estimate with its scores and all that is told about it.

    Parameters
    ----------
    name, file : str
        Short unique name, and the path as it was given.
    matches : Matches
        The poses of reference and estimate, as they were scored.
    result : PASResult
        The scores at the seed.
    tas_sd : float or None
        Standard deviation of the TAS over the seeds; None for a single one.
    ate : float or None
        RMSE of the estimated cameras after the least-squares alignment; None where there is none.
    body_rotation : (3, 3) ndarray or None
        Rotation of the camera's frame that was taken out.
    notes : list of str
        What its owner should know.
    """

    name: str
    file: str
    matches: Matches
    result: PASResult
    tas_sd: float | None
    ate: float | None
    body_rotation: NDArray[np.float64] | None
    notes: list[str]


def as_json(one: Scored) -> dict[str, Any]:
    """Return what the JSON output says of one estimate; no number in it is NaN or infinite."""
    tas, ras, matches = one.result.tas, one.result.ras, one.matches
    return {
        "name": one.name,
        "file": one.file,
        "TAS": tas.score,
        "TAS_sd": one.tas_sd,
        "RAS": ras.score,
        "PAS": one.result.score,
        "ATE": one.ate,
        "n": len(tas.errors),
        "matched": matches.matched,
        "missing": matches.missing,
        "non_finite": matches.non_finite,
        "duplicate": matches.duplicate,
        "unmatched": matches.unmatched,
        "unit": tas.unit,
        "within_unit": float(np.mean(tas.errors < tas.unit)),
        "within_10_deg": float(np.mean(ras.errors < 10.0)),
        "n_hypotheses": tas.n_hypotheses,
        "body_rotation": None if one.body_rotation is None else one.body_rotation.tolist(),
        "notes": one.notes,
    }


def table(scored: Sequence[Scored], unit_name: str) -> str:
    """Return the table of all estimates as text.

    Parameters
    ----------
    scored : sequence of Scored
        In the order of the rows.
    unit_name : str
        Name of the reference's unit of length.
    """
    header = (
        "estimate",
        "TAS",
        "TAS sd",
        "RAS",
        "PAS",
        f"ATE [{unit_name}]",
        f"d [{unit_name}]",
        "< d",
        "< 10°",
        "n",
        "matched",
        "missing",
        "non-finite",
        "duplicate",
    )
    rows = [header, *(_row(as_json(one)) for one in scored)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(header))]
    lines = []
    for row in rows:
        cells = [row[0].ljust(widths[0])]
        cells += [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        lines.append("  ".join(cells))
    return "\n".join(lines)


def _row(values: Mapping[str, Any]) -> tuple[str, ...]:
    def number(key: str, form: str) -> str:
        return "-" if values[key] is None else format(values[key], form)

    return (
        values["name"],
        number("TAS", ".4f"),
        number("TAS_sd", ".4f"),
        number("RAS", ".4f"),
        number("PAS", ".4f"),
        number("ATE", ".4g"),
        number("unit", ".4g"),
        number("within_unit", ".0%"),
        number("within_10_deg", ".0%"),
        *(str(values[key]) for key in ("n", "matched", "missing", "non_finite", "duplicate")),
    )


def unique_names(files: Sequence[str]) -> list[str]:
    """Return short names of files: as many of the last parts of their paths as tell them apart.

    Examples
    --------
    >>> from alignscores.cli.output import unique_names
    >>> unique_names(["a/orb.txt", "a/traj.txt", "b/traj.txt"])
    ['orb.txt', 'a/traj.txt', 'b/traj.txt']
    """
    parts = [Path(file).parts for file in files]
    names = []
    for own in parts:
        others = [other for other in parts if other != own]
        length = 1
        while length < len(own) and any(other[-length:] == own[-length:] for other in others):
            length += 1
        names.append(str(Path(*own[-length:])))
    return _numbered(names)  # the same file twice, perhaps by mistake


def _numbered(names: Sequence[str]) -> list[str]:
    """Tell equal names apart."""
    return [
        f"{name} ({names[:index].count(name) + 1})" if name in names[:index] else name
        for index, name in enumerate(names)
    ]


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

    A single estimate goes to `path`; of several, whose `names` are given though some may not have
    been scored, each to the path with its name appended. The error that evo makes statistics of is
    the share of the thresholds that a pose misses, from 0 to 1: its mean is 1 - PAS.

    Returns
    -------
    list of Path
        The files.
    """
    file_interface = require("evo.tools.file_interface", "files")
    from ..trajectories.evo import PAS  # needs evo

    files: dict[Path, bytes] = {}
    flat_names = dict(zip(names, _numbered([n.replace("/", "_") for n in names]), strict=True))
    for one in scored:
        flat_name = flat_names[one.name]
        result = PAS.of(one.result).get_result(reference, flat_name)
        result.add_info(
            {
                "title": f"PAS: share of the thresholds missed ({registration}, seed {seed})",
                "label": "share of the thresholds missed",
                "registration": registration,
                "seed": seed,
            }
        )
        values = as_json(one)
        result.add_stats({key: values[key] for key in ("ATE", "TAS_sd") if values[key] is not None})
        if one.matches.keys.dtype.kind == "f":
            result.add_np_array("timestamps", one.matches.keys)
        buffer = BytesIO()
        file_interface.save_res_file(buffer, result)
        own = path.with_name(f"{path.stem}_{flat_name}{path.suffix}") if names[1:] else path
        files[own] = buffer.getvalue()
    for file, content in files.items():
        write_whole(file, content)
    return list(files)


def save_figure(figure: Any, path: Path) -> None:
    """Save a figure, whole or not at all."""
    buffer = BytesIO()
    figure.savefig(buffer, format=path.suffix.removeprefix("."), dpi=200)
    write_whole(path, buffer.getvalue())


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a temporary name first, so that there is never half of it."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    except OSError as error:  # without the temporary name
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        temporary.unlink(missing_ok=True)
