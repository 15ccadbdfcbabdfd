"""Compile ``alignscores/registration/kernel.c`` where there is a C compiler.

Without one the package is pure Python, with the same results to the last bit. Only the wheels of a
release (``CIBUILDWHEEL=1``) must have it.
"""

import os
import shlex
import shutil
import subprocess
import sys
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# No -ffast-math and no fused products: the results are those of NumPy, on every processor.
FLAGS = ["-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-shared"]
# Windows has no -fPIC, and no library of its own for mathematics.
COMPILER, CODE, LIBRARIES = (
    ("clang", [], []) if sys.platform == "win32" else ("cc", ["-fPIC", "-pthread"], ["-lm"])
)


class KernelHook(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the compiled kernel to a wheel, or to the checkout of an editable installation."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile; what goes wrong there is no reason not to install, but one not to release."""
        source = Path(self.root, "alignscores", "registration", "kernel.c")
        # By this name kernel.py knows that it is of this source; ctypes loads .so on Windows, too.
        name = f"kernel-{sha256(source.read_bytes()).hexdigest()[:16]}.so"
        self.folder = TemporaryDirectory()  # until the wheel is built
        library = Path(self.folder.name, name)
        try:
            compile_kernel(source, library)
            if version == "editable":
                install(library, source.parent)
        except (OSError, ValueError, subprocess.CalledProcessError) as error:
            reason = getattr(error, "stderr", "") or error
            if os.environ.get("CIBUILDWHEEL"):
                sys.exit(f"no wheel without its kernel where CIBUILDWHEEL is set: {reason}")
            self.app.display_warning(f"alignscores is installed without its kernel: {reason}")
            return
        if version != "editable":
            build_data["force_include"][str(library)] = f"alignscores/registration/{name}"
            # Not manylinux or musllinux, which a wheel must be made to be.
            platform = self.build_config.builder.get_best_matching_tag().split("-")[-1]
            build_data.update(pure_python=False, tag=f"py3-none-{platform}")

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was compiled: the wheel has it."""
        self.folder.cleanup()


def compile_kernel(source: Path, library: Path) -> None:
    """Compile with ``$CC`` or ``cc``, on Windows ``clang``; on macOS for ``$ARCHFLAGS``."""
    compiler = shlex.split(os.environ.get("CC", COMPILER))
    flags = [*FLAGS, *CODE, *shlex.split(os.environ.get("ARCHFLAGS", ""))]
    command = [*compiler, *flags, "-o", str(library), str(source), *LIBRARIES]
    subprocess.run(command, check=True, capture_output=True, text=True, errors="replace")
    library.stat()  # an error, where it was not written


def install(library: Path, folder: Path) -> None:
    """Put the library there in one step, and remove those of other sources."""
    unfinished = folder / f"kernel-{os.getpid()}.so"
    shutil.copy(library, unfinished)
    unfinished.replace(folder / library.name)
    for other in folder.glob("kernel-*.so"):
        if other.name != library.name:
            other.unlink(missing_ok=True)
