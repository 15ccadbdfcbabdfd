"""The names and properties that others rely on."""

import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import alignscores
from alignscores import pas, ras, tas


@pytest.fixture
def results(noisy_scene, noisy_rotations):
    positions, rotations = noisy_scene(40, 10, 0.03, 0), noisy_rotations(40, 10, 3, 0)
    poses = [
        np.concatenate([r, p[:, :, None]], 2) for r, p in zip(rotations, positions, strict=True)
    ]
    return {"tas": tas(*positions), "ras": ras(*rotations), "pas": pas(*poses)}


def test_results_are_frozen(results):
    """No field can be set; float(result) is the score, which its repr shows."""
    for result in results.values():
        assert type(float(result)) is type(result.score) is float
        assert f"Result({result.score:.4f}, " in repr(result)
    for result in [*results.values(), results["tas"].alignment]:
        for field in dataclasses.fields(result):
            with pytest.raises(dataclasses.FrozenInstanceError):
                setattr(result, field.name, 0)


def in_fresh_process(code, **environment):
    root = Path(alignscores.__file__).parents[1]
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        env={**os.environ, "PYTHONPATH": str(root), **environment},
        check=True,
        capture_output=True,
        text=True,
    ).stdout


def test_import_needs_numpy_and_scipy_alone():
    """evo, pandas and the like are imported where they are used, people's files as well."""
    out = in_fresh_process("import sys; from alignscores import tas; print(*sys.modules)")
    modules = set(out.split())
    heavy = {"evo", "pandas", "matplotlib", "hydra", "joblib", "snakemake", "numba", "pycolmap"}
    assert heavy.isdisjoint(modules)
    assert "alignscores.registration.kernel" in modules
    of_files = ("io", "evaluation", "comparison", "show", "cli")
    assert {f"alignscores.{name}" for name in of_files}.isdisjoint(modules)


def test_what_reads_files_is_imported_when_it_is_asked_for():
    out = in_fresh_process("import sys; from alignscores import evaluate; print(*sys.modules)")
    heavy = {"pandas", "matplotlib", "evo", "plotly", "alignscores.cli"}
    assert heavy.isdisjoint(out.split())
    out = in_fresh_process("import sys; from alignscores import *; print(evaluate, *sys.modules)")
    assert out.startswith("<function evaluate ")
    assert "alignscores.comparison" in out.split()
    assert (heavy - {"pandas"}).isdisjoint(out.split())  # a comparison holds tables of pandas
    assert set(dir(alignscores)) >= {"Comparison", "Evaluation", "Settings", "compare", "evaluate"}
    with pytest.raises(AttributeError, match="'alignscores' has no attribute 'score'"):
        _ = alignscores.score


def test_same_bits_in_another_process():
    """Nor does the answer depend on the hash seed or on the number of BLAS threads."""
    code = """
import numpy as np
from alignscores import ras, tas
rng = np.random.default_rng(0)
for n in (15, 100, 600, 3000):
    gt = rng.random((n, 3))
    est = gt + rng.normal(0, 0.03, (n, 3))
    est[: n // 3] = 10 * rng.random((n // 3, 3))
    for name in ("pcr99", "refined"):
        result = tas(gt, est, registration=name)
        print(result.errors.tobytes().hex(), result.alignment.rotation.tobytes().hex())
        print(result.score)
    n = min(n, 600)
    q = rng.normal(size=(2, n, 3, 3))
    q, _ = np.linalg.qr(q)
    q[..., 0] *= np.linalg.det(q)[..., None]
    print(ras(q[0], q[1]).errors.tobytes().hex())
"""
    outputs = {
        in_fresh_process(code, PYTHONHASHSEED=str(threads), OPENBLAS_NUM_THREADS=str(threads))
        for threads in (1, 2)
    }
    assert len(outputs) == 1
    assert len(outputs.pop()) > 10_000
