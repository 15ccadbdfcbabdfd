"""What the command refuses before it computes anything: outputs that would replace an input."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from ..trajectories.files import STDIN

__all__ = ["check_stdin_read_once", "refuse_to_replace"]


def check_stdin_read_once(files: Iterable[str | None]) -> None:
    """Refuse to take what stands on stdin for two files."""
    if list(files).count(STDIN) > 1:
        raise ValueError("stdin (-) can be one file only")


def refuse_to_replace(inputs: Iterable[str], outputs: Iterable[tuple[str, Path]]) -> None:
    """Refuse outputs, by option, that are an input, by whatever path or link, or another output."""
    identities = {identity: file for path in inputs for identity, file in _identities(Path(path))}
    taken: dict[Path, str] = {}
    for option, path in outputs:
        for identity in (_identity(path), _identity(path.resolve())):
            if identity in identities:
                raise ValueError(
                    f"{option} {path} would replace the input {identities[identity]}; name another "
                    "file"
                )
        target = path.parent.resolve() / path.name
        if target in taken:
            raise ValueError(f"{option} and {taken[target]} would both write {path}")
        taken[target] = option


def _identities(path: Path) -> Iterator[tuple[object, Path]]:
    """Yield what identifies an input file, or each file of an input folder."""
    files = path.rglob("*") if path.is_dir() else [path]
    for file in files:
        if (identity := _identity(file)) is not None:
            yield identity, file


def _identity(path: Path) -> tuple[int, int] | None:
    """Return what all paths and links of one file have in common; None where there is no file."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino
