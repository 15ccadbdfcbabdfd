"""What all test modules share: the published reference values and Hypothesis' settings."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from numpy.typing import NDArray

REFERENCE = (
    Path(__file__).resolve().parents[2] / "shared" / "reference" / "alignment_scores_octave.npz"
)

# Same examples in every run, and no time limit for each: the machine may be busy.
settings.register_profile("alignscores", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("alignscores")


@dataclass(frozen=True)
class ReferenceCase:
    """One trajectory with the outputs of the published implementation; ``case["d_threshold"]``."""

    name: str
    meta: Mapping[str, Any]
    arrays: Mapping[str, NDArray[np.float64]]

    def __getitem__(self, array: str) -> NDArray[np.float64]:
        return self.arrays[array]


@pytest.fixture(scope="session")
def reference_cases() -> dict[str, ReferenceCase]:
    """All cases of the reference file by name; skips where the file is not there."""
    if not REFERENCE.exists():
        pytest.skip(f"no reference values at {REFERENCE}")
    with np.load(REFERENCE, allow_pickle=False) as file:
        cases = {}
        for text in file["cases"]:
            meta = json.loads(str(text))
            prefix = meta["case"] + "/"
            arrays = {key.removeprefix(prefix): file[key] for key in file if key.startswith(prefix)}
            cases[meta["case"]] = ReferenceCase(meta["case"], meta, arrays)
    return cases


@pytest.fixture
def reference_case(
    request: pytest.FixtureRequest, reference_cases: dict[str, ReferenceCase]
) -> ReferenceCase:
    """One case, named by ``@pytest.mark.parametrize("reference_case", [...], indirect=True)``."""
    return reference_cases[request.param]
