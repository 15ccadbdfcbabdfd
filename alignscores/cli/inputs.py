"""Checks of inputs and outputs before anything is computed."""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from ..evaluation.matching import files_below
from ..writing import check_target

__all__ = ["refuse_to_replace"]


def refuse_to_replace(inputs: Iterable[str], outputs: Iterable[tuple[str, Path]]) -> None:
    """Check that the outputs, by option, can be written and replace no input or other output."""
    files = [file for path in inputs for file in files_below(path)]
    known = {_identity(file): file for file in files}
    used: dict[Path, str] = {}
    for option, path in outputs:
        try:
            with suppress(IsADirectoryError):  # an error at the end, after the others are saved
                check_target(path)
        except OSError as error:
            raise ValueError(f"{option} {path} cannot be written ({error.strerror})") from None
        identity = _identity(path)
        if identity and (replaced := known.get(identity)):
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
