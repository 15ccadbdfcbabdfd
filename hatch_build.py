"""Compile the registration, ``alignscores/registration/kernel``, by ``$CC``, ``cc`` or Zig.

A hook of Hatchling and not scikit-build-core or meson-python, since it can require Zig's compiler
where there is no other, most of all on Windows; since ctypes needs one wheel a platform for all
versions of Python, and no headers; and since an editable installation offers packages, such as
`experiments`, that the wheel does not have. The name of the library has a hash of its sources: a
checkout whose C files have changed asks to be compiled, instead of scoring by an old kernel.
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

# No -ffast-math and no fused products: the same numbers on every processor. `omp simd` marks the
# sums whose order the compiler may choose.
FLAGS = ["-std=c11", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]
FLAGS += ["-fopenmp-simd", "-fvisibility=hidden", "-shared"]
KERNEL = Path("alignscores", "registration", "kernel")


class KernelHook(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the compiled kernel to a wheel, or to the checkout of an editable installation."""

    def dependencies(self) -> list[str]:
        """Require Zig's compiler where there is no other."""
        return [] if compiler() else ["ziglang>=0.13"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile."""
        folder = Path(self.root, KERNEL)
        digest = sha256()
        for source in sorted(folder.glob("*.[ch]")):
            digest.update(source.read_bytes())
        # The package finds the library of its sources by this name; one that ended in .so would
        # pass for a Python module. ctypes loads it on Windows, too.
        name = f"kernel.so.{digest.hexdigest()[:16]}"
        self.folder = TemporaryDirectory()  # until the wheel is built
        library = Path(self.folder.name, name)
        plain = library.with_name("kernel.so")  # Pyodide's compiler knows a library by its name
        try:
            compile_kernel(folder, plain)
            plain.rename(library)
        except (OSError, ValueError, subprocess.CalledProcessError) as error:
            reason = getattr(error, "stderr", "") or error
            sys.exit(f"alignscores needs a C compiler, such as gcc, clang or CC=...: {reason}")
        if version == "editable":
            install(library, folder)
            return
        build_data["force_include"][str(library)] = f"{KERNEL.as_posix()}/{name}"
        # Not manylinux or musllinux, which a wheel must be made to be.
        platform = self.build_config.builder.get_best_matching_tag().split("-")[-1]
        build_data.update(pure_python=False, tag=f"py3-none-{platform}")

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove what was compiled: the wheel has it."""
        self.folder.cleanup()


def compiler() -> list[str]:
    """Return the command of the C compiler, empty if there is none but perhaps Zig's."""
    if "CC" in os.environ:
        return shlex.split(os.environ["CC"])
    names = ["clang"] if sys.platform == "win32" else ["cc", "gcc", "clang"]
    return next(([name] for name in names if shutil.which(name)), [])


def compile_kernel(folder: Path, library: Path) -> None:
    """Compile with ``$CFLAGS`` and ``$LDFLAGS``, which come last; on macOS for ``$ARCHFLAGS``."""
    command = compiler() or [sys.executable, "-m", "ziglang", "cc"]
    # Windows has no -fPIC, and no separate library for mathematics.
    code, libraries = ([], []) if sys.platform == "win32" else (["-fPIC"], ["-lm"])
    sources = map(str, sorted(folder.glob("*.c")))
    c_flags, architecture, linker_flags = (
        shlex.split(os.environ.get(name, "")) for name in ("CFLAGS", "ARCHFLAGS", "LDFLAGS")
    )
    command += [*FLAGS, *code, *c_flags, *architecture, "-o", str(library), *sources]
    command += [*linker_flags, *libraries]
    subprocess.run(command, check=True, capture_output=True, text=True, errors="replace")
    library.stat()  # an error, where it was not written


def install(library: Path, folder: Path) -> None:
    """Put the library there in one step, and remove libraries of other sources."""
    unfinished = folder / f"kernel.so.{os.getpid()}"
    shutil.copy(library, unfinished)
    unfinished.replace(folder / library.name)
    for other in folder.glob("kernel*.so*"):
        if other.name != library.name:
            other.unlink(missing_ok=True)
