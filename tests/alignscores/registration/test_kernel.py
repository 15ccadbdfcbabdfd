"""The compiled code: other builds of it, sanitizers, memory, processes and interruptions."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import alignscores

COMPILER = shutil.which("cc")
PACKAGE = Path(alignscores.__file__).parent
KERNEL = Path("registration", "kernel")
FLAGS = [
    "-std=c11",
    "-ffp-contract=off",
    "-fopenmp-simd",
    "-fvisibility=hidden",
    "-shared",
    "-fPIC",
]

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")


def built(folder, *flags):
    """Compile another kernel for a copy of the package; return the environment that imports it."""
    copy = folder / "alignscores"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("*.so.*", "__pycache__"))
    (installed,) = (PACKAGE / KERNEL).glob("kernel.so.*")
    sources = sorted((PACKAGE / KERNEL).glob("*.c"))
    library = copy / KERNEL / installed.name
    subprocess.run([COMPILER, *FLAGS, *flags, "-o", library, *sources, "-lm"], check=True)
    return {**os.environ, "PYTHONPATH": str(folder)}


def python(code, env=None, **options):
    command = [sys.executable, "-c", code]
    return subprocess.run(command, env=env, capture_output=True, text=True, check=False, **options)


SCORES = """
import numpy as np
from alignscores import tas
for n in (12, 40, 300, 1500):
    rng = np.random.default_rng(n)
    gt = rng.uniform(-1, 1, (n, 3))
    est = gt + rng.normal(0, 0.02, gt.shape)
    est[: n // 3] = rng.uniform(-2, 2, (n // 3, 3))
    for registration in ("pcr99", "refined"):
        result = tas(gt, est, registration=registration)
        print(result.score, result.unit, *result.errors.tolist())
"""


def test_another_build_gives_the_same_numbers(tmp_path):
    """As another compiler, or a processor with shorter vectors, would."""
    done = python(SCORES, built(tmp_path, "-O1", "-DEVERY_WIDTH="))
    assert done.stderr == ""
    here = python(SCORES).stdout
    a, b = (np.array(list(map(float, text.split()))) for text in (done.stdout, here))
    np.testing.assert_allclose(a, b, rtol=0, atol=1e-9)


HOSTILE = """
import warnings
import numpy as np
from alignscores import tas_batch, tas_distance
warnings.simplefilter("ignore")
rng = np.random.default_rng(0)
sizes = [*range(1, 61), 61, 128, 129, 251, 1003]
gt = [rng.normal(size=(n, 3)) for n in sizes]
est = [2 * p + 0.1 * rng.normal(size=p.shape) for p in gt]
for k, (p, q) in enumerate(zip(gt, est)):
    if k % 2:
        q[rng.random(len(q)) < 0.3] = [np.nan, 1e300, -1e300]
    if k % 3 == 0:
        p *= [1e300, 1e-320, 1.0][k % 9 // 3]
    if k % 5 == 0:
        q[rng.random(len(q)) < 0.1] *= 1e200
    if k % 7 == 0:
        q[:] = np.nan
    if k % 11 == 0:
        p[:] = p[0]
for n_hypotheses in (1, 2, 45, 1000):
    for registration in ("pcr99", "refined"):
        for alignment in ("similarity", "rigid", "yaw", "none"):
            tas_batch(gt, est, unit=0.1, registration=registration, alignment=alignment, up="x",
                      n_hypotheses=n_hypotheses, threads=2)
            tas_batch(gt, est, registration=registration, alignment=alignment)
for p, q in zip(gt, est):
    tas_distance(p, q, n_hypotheses=45)
print("done")
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sanitizer", "library"), [("address,undefined", "libasan.so"), ("thread", "libtsan.so")]
)
def test_sanitizers_find_nothing(tmp_path, sanitizer, library):
    """Neither reads nor writes beyond an array, nor undefined behaviour, nor races."""
    find = [COMPILER, f"-print-file-name={library}"]
    preload = subprocess.run(find, capture_output=True, text=True, check=False).stdout.strip()
    if not Path(preload).is_absolute():
        pytest.skip(f"there is no {library}")
    flags = ["-O1", "-g", f"-fsanitize={sanitizer}", "-DEVERY_WIDTH="]
    options = {"LD_PRELOAD": preload, "ASAN_OPTIONS": "detect_leaks=0", "OPENBLAS_NUM_THREADS": "1"}
    done = python(HOSTILE, built(tmp_path, *flags) | options)
    assert (done.stdout, done.stderr) == ("done\n", "")


@pytest.mark.slow
def test_memory_is_freed():
    """Of 10,000 calls, and of searches at several thresholds."""
    code = """
import resource
import numpy as np
from alignscores import tas, tas_distance
gt = np.random.default_rng(0).random((100, 3))
peaks = []
for n_calls in (500, 10_000):
    for call in range(n_calls):
        tas(gt, gt, registration=("pcr99", "refined")[call % 2], n_hypotheses=100)
        if call % 10 == 0:
            tas_distance(gt, gt, n_hypotheses=100)
    peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
assert peaks[1] - peaks[0] < 4096, peaks
"""
    assert python(code).stderr == ""


def test_forks_after_threads():
    code = """
import os, warnings
import numpy as np
from alignscores import tas_batch
warnings.simplefilter("ignore", DeprecationWarning)
scenes = np.random.default_rng(0).random((40, 20, 3))
expected = tas_batch(scenes, scenes, threads=3).score
child = os.fork()
found = tas_batch(scenes, scenes, threads=3).score
assert (found == expected).all()
if child:
    assert os.waitpid(child, 0)[1] == 0
"""
    done = python(code, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("threads", [1, 2])
def test_an_interruption_ends_a_batch(threads):
    """At once: threads do not go on with scenes that they have not begun."""
    code = f"""
import os, signal
import numpy as np
from alignscores import tas_batch
scenes = np.random.default_rng(0).random((20_000, 50, 3))
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it in the background
signal.signal(signal.SIGPROF, lambda *_: os.kill(os.getpid(), signal.SIGINT))
signal.setitimer(signal.ITIMER_PROF, 0.5)  # seconds of processor time
tas_batch(scenes, scenes, registration="refined", threads={threads})
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.stderr.strip().endswith("KeyboardInterrupt")
    assert done.returncode == -signal.SIGINT
