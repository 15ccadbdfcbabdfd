"""Compile ``alignscores/kernel.c`` where there is a C compiler.

Without one the package is pure Python, with the same results to the last bit.
"""

import os
import re
import shlex
import subprocess
import sysconfig
from hashlib import sha256
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# No -ffast-math and no fused products: the results are those of NumPy, on every processor.
FLAGS = ["-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]


class KernelHook(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the compiled kernel to a wheel, or to the checkout of an editable installation."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile; where that worked, the wheel is one for this platform."""
        if self._compiled(Path(self.root, "alignscores", "kernel.c")):
            platform = re.sub(r"\W", "_", sysconfig.get_platform())
            build_data.update(pure_python=False, tag=f"py3-none-{platform}")

    def _compiled(self, source: Path) -> bool:
        for old in source.parent.glob("kernel-*.so"):
            old.unlink()
        # By this name kernel.py knows that it is of this source.
        digest = sha256(source.read_bytes()).hexdigest()[:16]
        library = source.with_name(f"kernel-{digest}.so")
        unfinished = library.with_suffix(f".{os.getpid()}")
        compiler = shlex.split(os.environ.get("CC", "cc"))
        command = [*compiler, *FLAGS, "-shared", "-fPIC", "-o", str(unfinished), str(source), "-lm"]
        try:
            subprocess.run(command, check=True, capture_output=True, text=True)
        except (OSError, subprocess.CalledProcessError) as error:
            unfinished.unlink(missing_ok=True)
            reason = getattr(error, "stderr", "") or error
            self.app.display_warning(f"alignscores is installed without its kernel: {reason}")
            return False
        unfinished.replace(library)
        return True
