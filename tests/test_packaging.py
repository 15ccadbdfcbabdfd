"""What the packages import is what pyproject.toml declares."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import venv
import zipfile
from importlib.metadata import distribution, packages_distributions
from pathlib import Path

import pytest
from packaging.tags import platform_tags

from alignscores.cli import main as alignscores

from .golden.make import flat
from .golden.test_golden import compared

ROOT = Path(__file__).parents[1]
PACKAGES = ("alignscores", "baselines", "experiments", "studies", "figures", "report", "benchmarks")
IMPORT = re.compile(r'^\s*(?:import|from) (\w+)|require\("(\w+)', re.MULTILINE)


def normalised(name):
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.fixture(scope="module")
def declared():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"].values()
    required = [*project["dependencies"], *(name for extra in extras for name in extra)]
    return {normalised(re.match(r"[\w.-]+", name)[0]): name for name in required}


@pytest.fixture(scope="module")
def distributions():
    """Names of distributions by the modules that they bring."""
    return packages_distributions()


@pytest.mark.parametrize("package", [*PACKAGES, "tests"])
def test_all_that_is_imported_is_declared(package, declared, distributions):
    """Not left to what some other requirement happens to bring along."""
    imported = set()
    for path in (ROOT / package).rglob("*.py"):
        imported |= {
            imported_as or required for imported_as, required in IMPORT.findall(path.read_text())
        }
    foreign = {
        normalised(distribution)
        for module in imported - set(sys.stdlib_module_names) - set(PACKAGES)
        for distribution in distributions.get(module, [])
    }
    assert foreign - set(declared) == set()
    assert foreign  # something was looked at


def test_all_that_is_declared_has_a_lower_bound(declared):
    others = [name for name in declared.values() if not name.startswith("alignscores")]
    assert [name for name in others if ">=" not in name] == []


KERNEL = "alignscores/registration/kernel"
COMPILES = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


@pytest.fixture
def checkout(tmp_path):
    """What is built from in no plain folder, with a kernel left over from an older source."""
    copy = tmp_path / "größter checkout"
    copy.mkdir()
    for name in (".gitignore", "LICENSE", "README.md", "hatch_build.py", "pyproject.toml"):
        shutil.copy(ROOT / name, copy)
    leave = shutil.ignore_patterns("kernel-*.so", "__pycache__")
    shutil.copytree(ROOT / "alignscores", copy / "alignscores", ignore=leave)
    (copy / KERNEL / "kernel-0123456789abcdef.so").touch()
    return copy


def hatchling(checkout, version="standard", **environment):
    # -B: Python compiles the build hook into the checkout otherwise.
    command = [sys.executable, "-B", "-m", "hatchling", "build", "-t", f"wheel:{version}"]
    environment = os.environ | {"CFLAGS": "-O0"} | environment
    return subprocess.run(command, cwd=checkout, env=environment, capture_output=True, text=True)


def build(checkout, version="standard", **environment):
    """Build a wheel quickly, by a compiler that does not optimise."""
    quick = checkout.parent / "quick-cc"
    quick.write_text('#!/bin/sh\nexec cc "$@" -O0\n')
    quick.chmod(0o755)
    done = hatchling(checkout, version, **{"CC": str(quick), **environment})
    assert done.returncode == 0, done.stderr
    (wheel,) = (checkout / "dist").iterdir()
    return wheel


def loaded(place):
    """Score with the package at a place; return what is printed, and the error."""
    code = f"""
import sys
sys.path.insert(0, {str(place)!r})
import alignscores
assert alignscores.__file__.startswith({str(place)!r})
gt = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]]
print(alignscores.tas(gt, gt).score)
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.strip(), done.stderr.strip().split("\n")[-1]


@pytest.mark.slow
@COMPILES
def test_wheel(checkout, tmp_path):
    """The kernel is in it, for this platform and every Python; nothing else but the library."""
    before = sorted(checkout.rglob("*"))
    wheel = build(checkout)
    assert re.search(r"-py3-none-(?!any)\w+\.whl$", wheel.name)
    assert wheel.name.split("-")[-1].removesuffix(".whl") in platform_tags()
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0].split("-")[0] for name in names} == {"alignscores"}
    assert {f"{KERNEL}/scenes.c", f"{KERNEL}/kernel.h"} <= set(names)
    assert len([name for name in names if name.endswith(".so")]) == 1
    assert sorted(checkout.rglob("*")) == sorted([*before, wheel.parent, wheel])
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    assert loaded(tmp_path / "site") == ("1.0", "")


@pytest.mark.parametrize("compiler", ["no-such-compiler", "false", "cc '"])
def test_no_wheel_without_a_compiler(checkout, compiler):
    done = hatchling(checkout, CC=compiler)
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("alignscores needs a C compiler, such as gcc, clang or CC=...: ")
    assert not list((checkout / "dist").iterdir())


def test_zig_is_required_where_there_is_no_other_compiler():
    code = "from hatchling.build import *; print(get_requires_for_build_wheel())"

    def required(**environment):
        command = [sys.executable, "-c", code]
        return subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True
        ).stdout

    assert "ziglang" in required(PATH="/nowhere")
    assert "ziglang" not in required(PATH="/nowhere", CC="cc")


@pytest.mark.slow
@COMPILES
def test_flags_of_the_environment(checkout):
    """CFLAGS and LDFLAGS reach the compiler."""
    for name in ("CFLAGS", "LDFLAGS"):
        done = hatchling(checkout, **{name: "-no-such-flag"})
        assert done.returncode == 1
        assert "no-such-flag" in done.stderr


@pytest.mark.slow
@COMPILES
def test_editable_installation(checkout):
    """A kernel of other sources is not loaded, as after an update, until it is installed again."""
    build(checkout, "editable")
    (library,) = (checkout / KERNEL).glob("kernel-*")
    assert loaded(checkout) == ("1.0", "")
    with (checkout / KERNEL / "scenes.c").open("a") as source:
        source.write("/* changed */\n")
    printed, error = loaded(checkout)
    assert printed == ""
    assert error.startswith("ImportError: the registration of this version of alignscores is not")
    build(checkout, "editable")
    assert loaded(checkout) == ("1.0", "")
    assert not library.exists()
    (library,) = (checkout / KERNEL).glob("kernel-*")
    library.write_text("for another platform")
    assert loaded(checkout)[1] == error


@pytest.fixture
def bare_environment(checkout, tmp_path):
    """The folder of an environment with the wheel, NumPy and SciPy, and nothing else."""
    wheel = build(checkout)
    folder = tmp_path / "environment"
    venv.create(folder, symlinks=True)
    pip = [sys.executable, "-m", "pip", "--python", folder / "bin/python"]
    install = [*pip, "install", "--no-index", "--no-deps", wheel]
    subprocess.run(install, check=True, capture_output=True)
    (site,) = folder.glob("lib/python*/site-packages")
    for name in ("numpy", "scipy"):
        installed = distribution(name)
        for part in {file.parts[0] for file in installed.files} - {".."}:
            (site / part).symlink_to(installed.locate_file(part))
    return folder


NAMES = "from importlib import metadata; print(*(found.name for found in metadata.distributions()))"
TEXT_FILES = {
    "tum": ("reference.txt", "estimate.txt"),
    "euroc": ("data.csv", "estimate.txt"),
    "kitti": ("reference.txt", "estimate.txt"),
    "nerf": ("reference.json", "estimate.json"),
}


@pytest.mark.slow
def test_numpy_and_scipy_alone_score_text_files(bare_environment, monkeypatch, capsys):
    """With the numbers that the command has where everything is installed, by another build."""
    monkeypatch.chdir(ROOT / "tests/data")
    monkeypatch.delenv("PYTHONPATH", raising=False)

    def run(program, *arguments):
        command = [bare_environment / "bin" / program, *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    assert sorted(run("python", "-c", NAMES).split()) == ["alignscores", "numpy", "scipy"]
    for form, files in TEXT_FILES.items():
        arguments = form, *(f"{form}/{file}" for file in files), "--json"
        assert alignscores(arguments) == 0
        ours, theirs = (
            flat(json.loads(printed)["results"])
            for printed in (capsys.readouterr().out, run("alignscores", *arguments))
        )
        assert compared(theirs, ours) == []
