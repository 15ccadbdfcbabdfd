"""Results are as frozen in ``tests/golden/*.json``; `make` says what they are."""

import json
from math import inf

import pytest

from .inputs import REAL
from .make import FOLDER, RESULTS


@pytest.mark.parametrize("name", RESULTS)
def test_results_are_as_frozen(name, tmp_path):
    if name == "real_runs" and not REAL.is_dir():
        pytest.skip(f"no real trajectories at {REAL}")
    frozen = json.loads((FOLDER / f"{name}.json").read_text())
    differences = compared(RESULTS[name](tmp_path), frozen)
    size, line = max(differences, default=(0.0, ""))
    print(f"{name}: {len(frozen)} entries, {len(differences)} numbers differ; largest: {line}")
    assert size == 0.0, f"{len(differences)} numbers differ; largest difference {size:.3g}: {line}"


def test_a_small_change_of_any_number_is_seen():
    frozen = {"a": 0.5, "b": [2.0, 400.0, None], "c": 7}
    changes = [{"a": 0.500001}, {"b": [2.0, 400.000001, None]}, {"c": 8}, {"b": [2.0, 400.0, 0.0]}]
    for change in changes:
        assert len(compared(frozen | change, frozen)) == 1
    assert len(compared({"a": 0.5}, frozen)) == 2
    assert compared(dict(frozen), frozen) == []


def compared(found, frozen):
    """Return each number that differs: by how much, and a line that says where.

    1e-9, of a number above 1 the same share, is left to processors and compilers.
    """
    differences = []
    for key in sorted(found.keys() | frozen.keys()):
        if key not in found or key not in frozen:
            differences.append((inf, f"{key} is only in one of them"))
            continue
        pair = [v if isinstance(v, list) else [v] for v in (found[key], frozen[key])]
        if len(pair[0]) != len(pair[1]):
            differences.append((inf, f"{key} has {len(pair[0])} numbers, not {len(pair[1])}"))
            continue
        for index, (new, old) in enumerate(zip(*pair, strict=True)):
            size = difference(new, old)
            if size:
                differences.append((size, f"{key}[{index}] is {new}, not {old}"))
    return differences


def difference(new, old):
    if new is None or old is None:
        return 0.0 if new is old else inf
    size = abs(new - old)
    return size if size > 1e-9 * max(1.0, abs(old)) else 0.0
