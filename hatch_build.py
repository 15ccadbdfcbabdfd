"""Compile ``alignscores/registration/kernel.c`` where there is a C compiler.

Without one the package is pure Python, with the same results to the last bit.
"""

import os
import shlex
import shutil
import subprocess
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from packaging.tags import platform_tags

# No -ffast-math and no fused products: the results are those of NumPy, on every processor.
FLAGS = ["-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]


class KernelHook(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the compiled kernel to a wheel, or to the checkout of an editable installation."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile; whatever goes wrong there is no reason not to install."""
        source = Path(self.root, "alignscores", "registration", "kernel.c")
        # By this name kernel.py knows that it is of this source.
        name = f"kernel-{sha256(source.read_bytes()).hexdigest()[:16]}.so"
        self.folder = TemporaryDirectory()  # until the wheel is built
        library = Path(self.folder.name, name)
        try:
            compile_kernel(source, library)
            if version == "editable":
                install(library, source.parent)
        except (OSError, ValueError, subprocess.CalledProcessError) as error:
            reason = getattr(error, "stderr", "") or error
            self.app.display_warning(f"alignscores is installed without its kernel: {reason}")
            return
        if version != "editable":
            build_data["force_include"][str(library)] = f"alignscores/registration/{name}"
            portable = "manylinux", "musllinux"  # which a wheel must be made to be
            platform = next(tag for tag in platform_tags() if not tag.startswith(portable))
            build_data.update(pure_python=False, tag=f"py3-none-{platform}")

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was compiled: the wheel has it."""
        self.folder.cleanup()


def compile_kernel(source: Path, library: Path) -> None:
    """Compile with ``$CC`` or ``cc``."""
    compiler = shlex.split(os.environ.get("CC", "cc"))
    command = [*compiler, *FLAGS, "-shared", "-fPIC", "-o", str(library), str(source), "-lm"]
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
