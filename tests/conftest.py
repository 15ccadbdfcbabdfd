"""Common to all test modules: reference values, levels, and Hypothesis' settings."""

import json
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.abc import MetaPathFinder
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from alignscores.arrays import Floats

os.environ["COLUMNS"] = "100"  # of tables; pytest-xdist sets 80

TESTS = Path(__file__).resolve().parent
REFERENCE = (  # the second has further cases of 200 cameras and more
    TESTS / "data" / "published.npz",
    TESTS.parents[1] / "shared" / "reference" / "alignment_scores_octave.npz",
)

OF_LEVELS = {  # folders and files, as in README.md
    "mathematics": ("alignscores", "baselines"),
    "library": (
        *("alignscores/comparison", "alignscores/evaluation", "alignscores/io"),
        *("alignscores/show", "alignscores/test_real.py", "alignscores/test_torch.py"),
    ),
    "command": ("alignscores/cli", "golden"),
    "study": ("cluster", "experiments", "figures", "studies", "workflow"),
    "house": (
        *(".", "alignscores/test_interface.py", "alignscores/test_interruptions.py"),
        "alignscores/test_texts.py",
        *("alignscores/test_writing.py", "alignscores/test_yaml_files.py", "benchmarks"),
    ),
}
LEVELS = {Path(path): level for level, paths in OF_LEVELS.items() for path in paths}

# The processes that run tests in parallel inherit it, and the programs that they start: further
# threads of BLAS would only spin until a core is free.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Fonts and sources that programs keep for later: no test depends on the home directory.
os.environ["XDG_CACHE_HOME"] = str(TESTS.parent / ".pytest_cache" / "programs")
# Without it each of the many programs that tests start would compile the project anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


class SkipWithoutWheel(MetaPathFinder):
    """Asked last: a test that imports pycolmap is skipped where there is none, as on ARM Linux."""

    def find_spec(self, fullname, path, target=None):
        """Skip."""
        if fullname == "pycolmap":
            pytest.skip("pycolmap is not installed", allow_module_level=True)


sys.meta_path.append(SkipWithoutWheel())

# Same examples in every run, and no time limit for each: the machine may be busy.
settings.register_profile("alignscores", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("alignscores")


@pytest.hookimpl(optionalhook=True)  # a release tests its wheels without pytest-xdist
def pytest_xdist_auto_num_workers():
    """One process more than cores: some tests wait for the programs that they have started."""
    return (os.cpu_count() or 1) + 1


def pytest_collection_modifyitems(items):
    """Mark each test with its level; begin with the longest tests, so that no process waits."""
    items.sort(key=lambda item: "workflow" not in item.path.parts)
    for item in items:
        if TESTS in item.path.parents:
            path = item.path.relative_to(TESTS)
            item.add_marker(next(LEVELS[p] for p in (path, *path.parents) if p in LEVELS))


@dataclass(frozen=True)
class ReferenceCase:
    """One trajectory with the outputs of the published implementation; ``case["d_threshold"]``."""

    name: str
    meta: Mapping[str, Any]
    arrays: Mapping[str, Floats]

    def __getitem__(self, array):
        return self.arrays[array]


@pytest.fixture(scope="session")
def reference_cases():
    """All cases of the reference files by name."""
    cases = {}
    for path in filter(Path.exists, REFERENCE):
        with np.load(path, allow_pickle=False) as file:
            for text in file["cases"]:
                meta = json.loads(str(text))
                prefix = meta["case"] + "/"
                arrays = {k.removeprefix(prefix): file[k] for k in file if k.startswith(prefix)}
                cases[meta["case"]] = ReferenceCase(meta["case"], meta, arrays)
    return cases


@pytest.fixture
def reference_case(request, reference_cases):
    """One case, named by ``@pytest.mark.parametrize("reference_case", [...], indirect=True)``."""
    if request.param not in reference_cases:
        pytest.skip(f"{request.param} is not in {REFERENCE[0].name}")
    return reference_cases[request.param]


@pytest.fixture(scope="session")
def in_notebook():
    """(result) -> the HTML that a notebook shows of it."""
    return lambda result: result._repr_html_()
