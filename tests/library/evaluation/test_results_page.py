"""The JSON of an evaluation has the keys and types that docs/reference/results.md gives."""

import re
from pathlib import Path

import pytest

from tests.files import FILES

PAGE = Path(__file__).parents[3] / "docs/reference/results.md"
ROW = re.compile(r"^\| (`[^|]*`) \| ([a-z ]+) \| .* \|$", re.MULTILINE)
TYPES = {
    "string": str,
    "number": float,
    "integer": int,
    "array": list,
    "object": dict,
    "null": type(None),
}
SCHEMA = {
    key: tuple(TYPES[kind] for kind in kinds.split(" or "))
    for keys, kinds in ROW.findall(PAGE.read_text("utf-8"))
    for key in re.findall(r"`(\w+)`", keys)
}


@pytest.mark.parametrize("format_name", FILES)
def test_results_are_as_described(score, format_name):
    for options in ((), ("--registration", "pcr99", "--repeat", 2, "--metrics", "ate,auc@30:vggt")):
        (result,) = score(format_name, *FILES[format_name], *options)
        assert set(result) == set(SCHEMA)
        for key, value in result.items():
            assert isinstance(value, SCHEMA[key]), key
        assert all(set(note) == {"kind", "text", "remedy"} for note in result["notes"])
        for name, value in (("TAS", result["TAS_seeds"][0]), ("RAS", result["RAS"])):
            costs = [stretch["cost"] for stretch in result["deficits"] if stretch["score"] == name]
            assert sum(costs) == pytest.approx(1 - value, abs=1e-12)
