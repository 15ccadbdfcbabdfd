"""What the packages import is what pyproject.toml declares."""

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


KERNEL = "alignscores/registration"  # the folder of the kernel
COMPILES = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


def copied(folder):
    """Copy what is built from to no plain path, with a kernel left over from an older source."""
    copy = folder / "größter checkout"
    copy.mkdir()
    for name in (".gitignore", "LICENSE", "README.md", "hatch_build.py", "pyproject.toml"):
        shutil.copy(ROOT / name, copy)
    leave = shutil.ignore_patterns("kernel-*.so", "__pycache__")
    shutil.copytree(ROOT / "alignscores", copy / "alignscores", ignore=leave)
    (copy / KERNEL / "kernel-0123456789abcdef.so").touch()
    return copy


@pytest.fixture
def checkout(tmp_path):
    return copied(tmp_path)


@pytest.fixture(scope="module")
def quick_compiler(tmp_path_factory):
    """One that takes no time to optimise: the same bits, a sixth of the time."""
    path = tmp_path_factory.mktemp("compiler") / "quick-cc"
    path.write_text('#!/bin/sh\nexec cc "$@" -O0\n')
    path.chmod(0o755)
    return str(path)


@pytest.fixture(scope="module")
def installed(tmp_path_factory, quick_compiler):
    """A checkout after an editable installation."""
    copy = copied(tmp_path_factory.mktemp("installed"))
    build(copy, "editable", CC=quick_compiler)
    return copy


@pytest.fixture
def editable(installed, tmp_path):
    """The same, to be changed."""
    return shutil.copytree(installed, tmp_path / installed.name)


def hatchling(checkout, version="standard", **environment):
    # -B: Python compiles the build hook into the checkout otherwise.
    command = [sys.executable, "-B", "-m", "hatchling", "build", "-t", f"wheel:{version}"]
    return subprocess.run(
        command, cwd=checkout, env=os.environ | environment, capture_output=True, text=True
    )


def build(checkout, version="standard", **environment):
    """Build a wheel; return it with what was printed."""
    done = hatchling(checkout, version, **environment)
    assert done.returncode == 0, done.stderr
    (wheel,) = (checkout / "dist").iterdir()
    return wheel, done.stdout + done.stderr


def kernels(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0].split("-")[0] for name in names} == {"alignscores"}
    assert f"{KERNEL}/kernel.c" in names
    assert "alignscores/explorer/scores.js" in names
    return [name for name in names if name.endswith(".so")]


LOADED = """
import sys
sys.path.insert(0, {place!r})
from alignscores import tas
from alignscores.registration import kernel
print(kernel.__file__.startswith({place!r}), kernel.LIBRARY is not None)
gt = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]]
print(tas(gt, gt).score)
"""


def loaded(place):
    done = subprocess.run(
        [sys.executable, "-c", LOADED.format(place=str(place))],
        capture_output=True,
        text=True,
        check=True,
    )
    *facts, score = done.stdout.split()
    assert score == "1.0"
    return facts


@pytest.mark.slow
@COMPILES
def test_wheel_with_a_compiler(checkout, tmp_path, quick_compiler):
    """The kernel is in it, for this platform and every Python; nothing else but the library."""
    before = sorted(checkout.rglob("*"))
    wheel, _ = build(checkout, CC=quick_compiler)
    assert re.search(r"-py3-none-(?!any)\w+\.whl$", wheel.name)
    assert wheel.name.split("-")[-1].removesuffix(".whl") in platform_tags()
    assert len(kernels(wheel)) == 1
    assert sorted(checkout.rglob("*")) == sorted([*before, wheel.parent, wheel])
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    assert loaded(tmp_path / "site") == ["True", "True"]


@pytest.mark.slow
@pytest.mark.parametrize("compiler", ["no-such-compiler", "false", "cc '"])
def test_wheel_without_a_compiler(checkout, tmp_path, compiler):
    """Said, and no reason not to install: the library works."""
    wheel, printed = build(checkout, CC=compiler)
    assert wheel.name.endswith("-py3-none-any.whl")
    assert kernels(wheel) == []
    assert "alignscores is installed without its kernel" in printed
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    assert loaded(tmp_path / "site") == ["True", "False"]


def test_no_release_without_the_kernel(checkout):
    """Where cibuildwheel builds, a compiler that fails is an error, told in one line."""
    done = hatchling(checkout, CC="no-such-compiler", CIBUILDWHEEL="1")
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("no wheel without its kernel where CIBUILDWHEEL is set: ")
    assert "no-such-compiler" in line
    assert not list((checkout / "dist").iterdir())


@COMPILES
def test_editable_installation(editable):
    """The kernel of this source is in the checkout, those of others are gone, if all went well."""
    (library,) = (editable / KERNEL).glob("kernel-*")
    assert loaded(editable) == ["True", "True"]
    build(editable, "editable", CC="false")  # as good as before
    assert list((editable / KERNEL).glob("kernel-*")) == [library]


@pytest.mark.slow
@COMPILES
def test_kernel_of_another_source_is_not_loaded(editable, quick_compiler):
    """As after an update of a checkout, until it is installed again."""
    with (editable / KERNEL / "kernel.c").open("a") as source:
        source.write("/* changed */\n")
    assert loaded(editable) == ["True", "False"]
    build(editable, "editable", CC=quick_compiler)
    assert loaded(editable) == ["True", "True"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["kernel-*.so", "kernel.c"])
def test_kernel_that_cannot_be_loaded(editable, name):
    """One for another platform, or Python files that were bundled alone."""
    for path in (editable / KERNEL).glob(name):
        path.write_text("not a library") if path.suffix == ".so" else path.unlink()
    assert loaded(editable) == ["True", "False"]


@pytest.fixture
def bare_environment(checkout, tmp_path, quick_compiler):
    """The folder of an environment with the wheel, NumPy and SciPy, and nothing else."""
    wheel, _ = build(checkout, CC=quick_compiler)
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
    """With the numbers, to the last bit, that the command has where everything is installed."""
    monkeypatch.chdir(ROOT / "tests/data")
    monkeypatch.delenv("PYTHONPATH", raising=False)

    def run(program, *arguments):
        command = [bare_environment / "bin" / program, *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    assert sorted(run("python", "-c", NAMES).split()) == ["alignscores", "numpy", "scipy"]
    for form, files in TEXT_FILES.items():
        arguments = form, *(f"{form}/{file}" for file in files), "--json"
        assert alignscores(arguments) == 0
        assert run("alignscores", *arguments) == capsys.readouterr().out
