"""Print a page: ``python -m report.pdf FILE.html --output FILE.pdf``. A Chromium does it."""

import re
import shutil
import subprocess
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from experiments.command import CommandError, run_command
from experiments.tables import write_files

__all__ = ["browser", "main"]

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--no-pdf-header-footer",
)
PATIENCE = 300  # seconds
DATE = re.compile(rb"(?<=Date \(D:)\d{14}")  # of the printing


def browser() -> str | None:
    """Return the program that prints, or None where there is none."""
    return next(filter(None, map(shutil.which, NAMES)), None)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a page; return the exit code."""
    parser = ArgumentParser(prog="python -m report.pdf", description="Print a page.")
    parser.add_argument("page", type=Path, metavar="HTML")
    parser.add_argument("--output", type=Path, required=True, metavar="PDF")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    write_files({options.output: _print(options.page)})
    return [options.output]


def _print(page: Path) -> bytes:
    program = browser()
    if program is None:
        raise CommandError(f"printing takes one of these programs: {', '.join(NAMES)}")
    if not page.is_file():
        raise CommandError(f"{page} does not exist")
    with TemporaryDirectory() as folder:
        printed = Path(folder, "page.pdf")
        flags = [*FLAGS, f"--user-data-dir={folder}/profile", f"--print-to-pdf={printed}"]
        try:
            subprocess.run(
                [program, *flags, page.resolve().as_uri()],
                capture_output=True,
                timeout=PATIENCE,
                check=True,
            )
            content = printed.read_bytes()
        except (OSError, subprocess.SubprocessError) as error:
            raise CommandError(f"{program} cannot print {page}: {error}") from None
    return DATE.sub(b"19700101000000", content)  # the same page, the same bytes


if __name__ == "__main__":
    sys.exit(main())
