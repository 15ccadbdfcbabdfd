"""Who imports whom: one way, without a circle; the command alone knows argparse."""

import ast
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = (
    "alignscores",
    "baselines",
    "benchmarks",
    "experiments",
    "figures",
    "report",
    "studies",
)
LAYERS = (  # each imports those before it, and itself
    {"arrays", "parallel", "streams", "texts", "validation", "version", "writing", "yaml_files"},
    {"registration", "similarity", "averaging", "medoid", "histogram", "pairs", "aligner"},
    {"translation", "rotation", "pose", "distance", "profile", "batch", "protocols", "metrics"},
    {"trajectories", "torch"},
    {"evaluation"},
    {"comparison"},
    {"pages", "plots", "rerun"},
    {"cli"},
)

ON_DEMAND = {  # imported by a method that saves a page
    "alignscores.comparison.comparison": {"alignscores.pages.comparison"},
}


def module_name(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {
    module_name(path): path for folder in PROJECT for path in sorted((ROOT / folder).rglob("*.py"))
}


@cache
def imported(module):
    """Return what a module imports anywhere, in functions and under TYPE_CHECKING, too."""
    path = MODULES[module]
    package = module.split(".") if path.stem == "__init__" else module.split(".")[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*start, *(node.module or "").split(".")]).strip(".")
            inner = {f"{source}.{alias.name}" for alias in node.names} & set(MODULES)
            found |= inner
            if len(inner) < len(node.names):
                found.add(source)
    return found


LIBRARY = [module for module in MODULES if module.startswith("alignscores")]


# An evaluation draws itself: its methods import these when they are called.
DRAWN = {"alignscores.plots", "alignscores.pages.estimates"}


def of_project(module):
    drawn = DRAWN if module == "alignscores.evaluation.evaluation" else set()
    return imported(module) & set(MODULES) - drawn


def layer(module):
    """Return the place of a module of the library in `LAYERS`; the package itself is the last."""
    name = module.split(".")[1] if "." in module else ""
    return next((place for place, names in enumerate(LAYERS) if name in names), len(LAYERS))


def circle(imports):
    """Return modules that import each other in turn, nothing where there are none."""
    done = set()

    def visit(module, path):
        if module in path:
            return [*path[path.index(module) :], module]
        if module in done:
            return []
        for other in sorted(imports[module]):
            if found := visit(other, [*path, module]):
                return found
        done.add(module)
        return []

    return next((found for module in sorted(imports) if (found := visit(module, []))), [])


def test_no_circle():
    imports = {module: of_project(module) - ON_DEMAND.get(module, set()) for module in LIBRARY}
    assert circle(imports) == []


@pytest.mark.parametrize("module", LIBRARY)
def test_imports_go_one_way(module):
    wrong = {other for other in of_project(module) if layer(other) > layer(module)}
    assert wrong <= ON_DEMAND.get(module, set())


def test_the_command_alone_knows_argparse():
    for module in LIBRARY:
        if not module.startswith("alignscores.cli"):
            assert "argparse" not in imported(module), module
            assert "Namespace" not in MODULES[module].read_text("utf-8"), module
