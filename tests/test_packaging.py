"""What the packages import is what pyproject.toml declares."""

import re
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("alignscores", "baselines", "benchmarks", "experiments", "figures", "report")
IMPORT = re.compile(r'^\s*(?:import|from) (\w+)|require\("(\w+)', re.MULTILINE)


def normalised(name):
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.fixture(scope="module")
def declared():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"].values()
    required = [*project["dependencies"], *(one for extra in extras for one in extra)]
    return {normalised(re.match(r"[\w.-]+", one)[0]): one for one in required}


@pytest.mark.parametrize("package", [*PACKAGES, "tests"])
def test_all_that_is_imported_is_declared(package, declared):
    """Not left to what some other requirement happens to bring along."""
    imported = set()
    for path in (ROOT / package).rglob("*.py"):
        imported |= {one or other for one, other in IMPORT.findall(path.read_text())}
    known = packages_distributions()
    foreign = {
        normalised(distribution)
        for module in imported - set(sys.stdlib_module_names) - set(PACKAGES)
        for distribution in known.get(module, [])
    }
    assert foreign - set(declared) == set()
    assert foreign  # something was looked at


def test_all_that_is_declared_has_a_lower_bound(declared):
    own = [one for one in declared.values() if not one.startswith("alignscores")]
    assert [one for one in own if ">=" not in one] == []
