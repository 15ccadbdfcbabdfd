"""The kernel in WebAssembly, compiled by Zig: loaded by Pyodide in Node, next to the native build.

Pyodide is `npm install pyodide`, found as Node finds packages (NODE_PATH, the global ones).
Its NumPy comes from the network: here the kernel's doors are called only by ctypes.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import alignscores
from alignscores import tas

KERNEL = Path(alignscores.__file__).parent / "registration" / "kernel"
FLAGS = "-std=c11", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fPIC", "-fvisibility=hidden"
N_HYPOTHESES = 200
N_SCENES = 20

NODE = """
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";
import { readFileSync } from "node:fs";
const file = createRequire(process.cwd() + "/").resolve("pyodide/pyodide.mjs");
const { loadPyodide } = await import(pathToFileURL(file).href);
const py = await loadPyodide();
for (const name of ["kernel.so", "scenes.json", "score.py"])
    py.FS.writeFile("/" + name, readFileSync(name));
console.log(py.runPython(readFileSync("score.py", "utf8")));
"""

SCORE = """
import ctypes, json
from ctypes import c_double, c_size_t, c_uint32, c_void_p

library = ctypes.CDLL("/kernel.so")
library.closest_distances.restype = c_double
NEXT = ctypes.CFUNCTYPE(c_uint32, c_void_p)

class Bits(ctypes.Structure):
    _fields_ = [("state", c_void_p), ("next_uint64", c_void_p), ("next_uint32", NEXT)]

def normalised(positions, n):
    points, frame = (c_double * (3 * n))(), (c_double * 4)(0, 0, 0, float("nan"))
    assert library.normalise(c_size_t(n), (c_double * (3 * n))(*positions), frame, points)
    return points, frame

found = []
for scene in json.load(open("/scenes.json")):
    n, gt, bits = len(scene["gt"]) // 3, scene["gt"], iter(scene["bits"])
    distances = (c_double * n)()
    library.closest_distances(c_size_t(n), (c_double * (3 * n))(*gt), distances)
    (gt, gt_frame), (est, est_frame) = normalised(gt, n), normalised(scene["est"], n)
    best, random = (c_double * 13)(), Bits(None, None, NEXT(lambda _: next(bits)))
    count = library.pcr99(
        c_size_t(n), gt, est, 0, c_size_t(max(4, (n + 5) // 10)), c_size_t(HYPOTHESES),
        c_double(0.1), ctypes.byref(random), best,
    )
    d = sorted(distances)[(3 * n + 3) // 4 - 1]
    found.append([d, count, list(best), list(gt_frame), list(est_frame)])
json.dumps(found)
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The kernel as a library of WebAssembly; there is no setjmp, for one thing."""
    pytest.importorskip("ziglang")
    folder = tmp_path_factory.mktemp("kernel")
    zig = [sys.executable, "-m", "ziglang"]
    for source in sorted(KERNEL.glob("*.c")):
        target = ["-target", "wasm32-wasi", "-c", "-o", folder / f"{source.stem}.o"]
        subprocess.run([*zig, "cc", *FLAGS, *target, source], check=True)
    link = ["wasm-ld", "-shared", "--experimental-pic", "--unresolved-symbols=import-dynamic"]
    file = folder / "kernel.so"
    subprocess.run([*zig, *link, "-o", file, *sorted(folder.glob("*.o"))], check=True)
    return file


@pytest.fixture(scope="module")
def node():
    """Node's command and environment; skips where it has no Pyodide."""
    command, npm = shutil.which("node"), shutil.which("npm")
    if not (command and npm):
        pytest.skip("there is no Node")
    root = subprocess.run([npm, "root", "-g"], capture_output=True, text=True, check=True).stdout
    paths = [os.environ.get("NODE_PATH", ""), root.strip()]
    env = {**os.environ, "NODE_PATH": os.pathsep.join(filter(None, paths))}
    arguments = [command, "-e", "require.resolve('pyodide/pyodide.mjs')"]
    if subprocess.run(arguments, env=env, capture_output=True, check=False).returncode:
        pytest.skip("Node has no package pyodide")
    return command, env


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_kernel_compiles_for_webassembly(library):
    assert library.read_bytes()[:4] == b"\0asm"


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_pyodide_registers_as_the_native_build(noisy_scene, library, node):
    """d, scale, rotation and translation, of random triplets (from 20 cameras on) and of all."""
    scenes, expected = [], []
    for seed in range(N_SCENES):
        n = 6 + 5 * seed
        gt, est = noisy_scene(n, n // 5, 0.01 + 0.005 * (seed % 5), seed)
        expected.append(tas(gt, est, rng=seed, n_hypotheses=N_HYPOTHESES))
        bits = np.random.default_rng(seed).integers(2**32, size=20_000, dtype=np.uint32)
        arrays = {"gt": gt.ravel(), "est": est.ravel(), "bits": bits}
        scenes.append({name: array.tolist() for name, array in arrays.items()})
    (library.parent / "scenes.json").write_text(json.dumps(scenes))
    (library.parent / "score.py").write_text(SCORE.replace("HYPOTHESES", str(N_HYPOTHESES)))
    command, env = node
    done = subprocess.run(
        [command, "--input-type=module", "-e", NODE],
        cwd=library.parent,
        env=env,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for result, (d, count, row, gt_frame, est_frame) in zip(
        expected, json.loads(done.stdout), strict=True
    ):
        alignment, rotation = result.alignment, np.reshape(row[1:10], (3, 3))
        scale = row[0] * est_frame[3] / gt_frame[3]
        translation = est_frame[:3] + est_frame[3] * np.array(row[10:])
        translation -= scale * rotation @ gt_frame[:3]
        assert (d, count) == (pytest.approx(result.unit, rel=1e-14), result.n_hypotheses)
        assert scale == pytest.approx(alignment.scale, rel=1e-12)
        np.testing.assert_allclose(rotation, alignment.rotation, atol=1e-12)
        np.testing.assert_allclose(
            translation, alignment.translation, atol=1e-12 * (1 + np.abs(translation).max())
        )
