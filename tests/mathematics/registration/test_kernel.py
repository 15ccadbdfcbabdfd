"""The compiled code: other builds of it, sanitizers, memory."""

import os
import shutil
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
from alignscores import ras, tas, tas_distance
warnings.simplefilter("ignore")

def distorted(points, rng):
    n, kind = len(points), rng.integers(14)
    if kind == 0:
        points = np.tile(points[:1], (n, 1))  # one place
    elif kind == 1:
        points = points[:, :1] * rng.normal(size=3)  # a line
    elif kind == 2:
        points = points * [1.0, 1.0, 0.0]  # a plane
    elif kind == 3:
        points = points[rng.integers(1 + n // 3, size=n)]  # places taken several times
    elif kind == 4:
        points = points * 2.0**-1060  # denormal
    elif kind == 5:
        points = points * 2.0**1020  # huge
    elif kind == 6:
        points = points * 10.0 ** rng.uniform(-320, 300, (n, 1))  # of all sizes
    elif kind == 7:
        points = np.zeros((n, 3))
    elif kind == 8:
        points = np.round(points)
    return points

def estimate(gt, rng):
    est = distorted(2 * gt + 0.1 * rng.normal(size=gt.shape), rng)
    lost = rng.random(len(gt)) < rng.choice([0, 0, 0.3, 1], p=[0.4, 0.3, 0.25, 0.05])
    est[lost] = [np.nan, 1e300, -np.inf]
    return est

for scene in range(2000):
    rng = np.random.default_rng(scene)
    n = int(rng.choice([rng.integers(1, 62), rng.integers(62, 300), 1003], p=[0.8, 0.18, 0.02]))
    gt = distorted(rng.normal(size=(n, 3)), rng)
    est = estimate(gt, rng)
    settings = {
        "alignment": ("similarity", "rigid", "yaw", "none")[scene % 4],
        "up": "zyx"[scene % 3],
        "n_hypotheses": int(rng.choice([1, 2, 45, 300, 1000])),
    }
    groups = rng.integers(1 + n // 2, size=n)
    for registration in ("pcr99", "refined"):
        tas(gt, est, registration=registration, unit=0.1, **settings)
        try:
            tas(gt, est, registration=registration, groups=groups, **settings)
        except ValueError:
            pass
    if scene % 10 == 0:
        tas_distance(gt, est, **settings)
        turns = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
        turns *= np.linalg.det(turns)[:, None, None]
        ras(turns, turns[rng.integers(n, size=n)])
print("done")
"""


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_sanitizers_find_nothing(tmp_path):
    """Neither reads nor writes beyond an array, nor undefined behaviour, in 2,000 scenes."""
    find = [COMPILER, "-print-file-name=libasan.so"]
    preload = subprocess.run(find, capture_output=True, text=True, check=False).stdout.strip()
    if not Path(preload).is_absolute():
        pytest.skip("there is no libasan.so")
    flags = ["-O1", "-g", "-fsanitize=address,undefined", "-DEVERY_WIDTH="]
    options = {"LD_PRELOAD": preload, "ASAN_OPTIONS": "detect_leaks=0", "OPENBLAS_NUM_THREADS": "1"}
    done = python(HOSTILE, built(tmp_path, *flags) | options)
    assert (done.stdout, done.stderr) == ("done\n", "")


@pytest.mark.slow
def test_memory_is_freed():
    """After 10,000 calls, and after searches at several thresholds."""
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
