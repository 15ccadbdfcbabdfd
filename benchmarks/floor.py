"""The floor: what a compiled loop over all hypotheses and cameras takes on this machine."""

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from alignscores.arrays import Floats

__all__ = ["compiled_loop", "counter"]


SOURCE = Path(__file__).with_name("floor.c")
# What -ffast-math stands for, but for its start-up code: that would flush the smallest numbers to 0
# in the whole process.
FAST = "-fno-math-errno -ffinite-math-only -fno-signed-zeros -fno-trapping-math -fassociative-math"
FLAGS = ["-O3", "-march=native", *FAST.split(), "-freciprocal-math", "-shared", "-fPIC"]


def compiled_loop() -> ctypes.CDLL | None:
    """Compile the loop; None where there is no C compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory() as directory:
        library = Path(directory) / "floor.so"
        subprocess.run([compiler, *FLAGS, "-o", library, SOURCE], check=True)
        return ctypes.CDLL(str(library))


def counter(
    library: ctypes.CDLL, hypotheses: Floats, gt: Floats, est: Floats, bound: float
) -> Callable[[], NDArray[np.intc]]:
    """Return a function that counts the cameras within a squared error of each hypothesis."""
    arrays = [np.ascontiguousarray(a, dtype=np.float64) for a in (hypotheses, gt.T, est.T)]
    counts = np.zeros(len(hypotheses), dtype=np.intc)
    h, g, e = (a.ctypes.data_as(ctypes.c_void_p) for a in arrays)
    c = counts.ctypes.data_as(ctypes.c_void_p)  # the pointers keep their arrays alive
    n_hypotheses, n = ctypes.c_size_t(len(hypotheses)), ctypes.c_size_t(len(gt))

    def count() -> NDArray[np.intc]:
        library.count_inliers(h, n_hypotheses, g, e, n, ctypes.c_double(bound), c)
        return counts

    return count
