"""One vocabulary: every metric by one name, whatever its case, or by an old one."""

import numpy as np
import pytest

from alignscores.metrics import FAMILIES, metric


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.example)
def test_every_name_is_found_in_any_case_and_is_of_one_family(family):
    name = family.example
    for asked in (name, name.lower(), f" {name.upper()} "):
        found = metric(asked)
        assert (found.name, found.family) == (name, family)
    others = [other for other in FAMILIES if other.arguments(name.lower()) is not None]
    assert others[0] is family
    assert [other.example for other in others[1:]] == (["ate:rmse"] if name == "ATE" else [])
    assert metric(name).worst == (0 if family.larger_is_better else np.inf)
