"""Packaging: requirements, source archive, wheels, container."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from importlib.metadata import distribution, packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.tags import platform_tags
from packaging.utils import canonicalize_name

from alignscores.cli import main as alignscores
from tests.command.golden.make import flat
from tests.command.golden.test_golden import like, numbers
from tests.files import FILES

ROOT = Path(__file__).parents[2]
PACKAGES = ("alignscores", "baselines", "experiments", "studies", "figures", "report", "benchmarks")
IMPORT = re.compile(r'^\s*(?:import|from) (\w+)|require\("(\w+)', re.MULTILINE)
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_all_that_is_imported_is_declared_with_a_lower_bound():
    """Not left to what some other requirement happens to bring along."""
    extras = SETTINGS["project"]["optional-dependencies"].values()
    texts = [*SETTINGS["project"]["dependencies"], *(text for extra in extras for text in extra)]
    declared = {canonicalize_name(each.name): each for each in map(Requirement, texts)}
    unbounded = {name for name, each in declared.items() if ">=" not in str(each.specifier)}
    assert unbounded == {"alignscores"}
    imported = set()
    for package in (*PACKAGES, "tests"):
        for path in (ROOT / package).rglob("*.py"):
            imported.update(*IMPORT.findall(path.read_text()))
    distributions = packages_distributions()
    foreign = {
        canonicalize_name(distribution)
        for module in imported - set(sys.stdlib_module_names) - set(PACKAGES)
        for distribution in distributions.get(module, [])
    }
    assert {"numpy", "scipy"} <= foreign <= set(declared)


KERNEL = "alignscores/registration/kernel"
COMPILES = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


def hatchling(folder, *arguments, check=True, **environment):
    # -B: Python compiles the build hook into the folder otherwise.
    command = [sys.executable, "-B", "-m", "hatchling", "build", "-t", *arguments]
    environment = os.environ | {"CFLAGS": "-O0"} | environment
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=check
    )


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """The source archive."""
    folder = tmp_path_factory.mktemp("archive")
    hatchling(ROOT, "sdist", "-d", folder)
    (archive,) = folder.iterdir()
    return archive


@pytest.fixture
def source(archive, tmp_path):
    """The source archive, unpacked in no plain folder."""
    with tarfile.open(archive) as file:
        file.extraction_filter = getattr(tarfile, "data_filter", None)  # since Python 3.11.4
        file.extractall(tmp_path / "größter Ordner")
    (source,) = (tmp_path / "größter Ordner").iterdir()
    return source


def wheel(source, **environment):
    """Build a wheel, quickly: the compiler does not optimise."""
    hatchling(source, "wheel", **environment)
    (wheel,) = (source / "dist").iterdir()
    return wheel


def environment(folder, wheel, *requirements):
    """Make an environment of the wheel and of requirements that are installed here, with theirs."""
    venv.create(folder, symlinks=True)
    pip = [sys.executable, "-m", "pip", "--python", folder / "bin/python"]
    install = [*pip, "install", "--no-index", "--no-deps", wheel]
    subprocess.run(install, check=True, capture_output=True)
    (site,) = folder.glob("lib/python*/site-packages")
    waiting = [Requirement(text) for text in ("numpy", "scipy", *requirements)]
    while waiting:
        requirement = waiting.pop()
        if requirement.marker and not requirement.marker.evaluate({"extra": ""}):
            continue
        installed = distribution(requirement.name)
        for part in {file.parts[0] for file in installed.files} - {"..", "__pycache__"}:
            if not (site / part).exists():
                (site / part).symlink_to(installed.locate_file(part))
        waiting += map(Requirement, installed.requires or [])
    return folder / "bin"


def loaded(folder):
    """Score with the package at a place; return what is printed, and the error."""
    code = """
import pkgutil
import alignscores.registration.kernel
gt = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]]
print(alignscores.tas(gt, gt).score)
print(*(module.name for module in pkgutil.iter_modules(alignscores.registration.kernel.__path__)))
"""
    command = [sys.executable, "-P", "-c", code]
    done = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": str(folder)}, capture_output=True, text=True
    )
    return done.stdout.split(), done.stderr.strip().split("\n")[-1]


@pytest.mark.slow
@COMPILES
def test_a_wheel_holds_the_library_for_every_python(source, tmp_path):
    """The kernel is in it, for this platform and every Python; nothing else but the library."""
    before = sorted(source.rglob("*"))
    built = wheel(source)
    assert sorted(source.rglob("*")) == sorted([*before, built.parent, built])
    assert re.search(r"-py3-none-(?!any)\w+\.whl$", built.name)
    assert built.name.split("-")[-1].removesuffix(".whl") in platform_tags()
    names = zipfile.ZipFile(built).namelist()
    assert {name.split("/")[0].split("-")[0] for name in names} == {"alignscores"}
    assert {f"{KERNEL}/pcr99.c", f"{KERNEL}/kernel.h"} <= set(names)
    zipfile.ZipFile(built).extractall(tmp_path / "site")
    assert loaded(tmp_path / "site") == (["1.0"], "")


NO_COMPILER = "alignscores needs a C compiler, such as gcc, clang or CC=...: "


@pytest.mark.parametrize(
    ("variable", "value", "reason"),
    [
        ("CC", "no-such-compiler", NO_COMPILER),
        ("CC", "cc '", NO_COMPILER),
        pytest.param("CFLAGS", "-no-such-flag", "no-such-flag", marks=COMPILES),
        pytest.param("LDFLAGS", "-no-such-flag", "no-such-flag", marks=COMPILES),
    ],
)
def test_no_wheel_with_a_wrong_compiler_or_wrong_flags(source, variable, value, reason):
    done = hatchling(source, "wheel", check=False, **{variable: value})
    assert done.returncode == 1
    assert reason in done.stderr
    assert len(done.stderr.splitlines()) == 1 or reason != NO_COMPILER
    assert not list((source / "dist").iterdir())


@pytest.mark.parametrize(("environment", "needed"), [({}, True), ({"CC": "cc"}, False)])
def test_zig_is_required_where_there_is_no_other_compiler(environment, needed):
    code = "from hatchling.build import *; print(get_requires_for_build_wheel())"
    command = [sys.executable, "-c", code]
    environment = {"PATH": "/nowhere", **environment}
    printed = subprocess.check_output(command, cwd=ROOT, env=environment, text=True)
    assert ("ziglang" in printed) == needed


@pytest.mark.slow
@COMPILES
def test_an_editable_installation_notices_other_sources(source):
    """A kernel of other sources is not loaded, as after an update, until it is installed again."""
    hatchling(source, "wheel:editable")
    (library,) = (source / KERNEL).glob("kernel.so.*")
    assert loaded(source) == (["1.0"], "")
    with (source / KERNEL / "pcr99.c").open("a") as file:
        file.write("/* changed */\n")
    printed, error = loaded(source)
    assert printed == []
    assert error.startswith("ImportError: the registration of this version of alignscores is not")
    hatchling(source, "wheel:editable")
    assert loaded(source) == (["1.0"], "")
    assert not library.exists()
    (library,) = (source / KERNEL).glob("kernel.so.*")
    library.write_text("for another platform")
    assert loaded(source)[1] == error


@pytest.mark.slow
@COMPILES
@pytest.mark.parametrize("compiler", ["cc", f"{shlex.quote(sys.executable)} -m ziglang cc"])
def test_a_wheel_of_the_source_archive_passes_the_tests_of_a_release(source, tmp_path, compiler):
    """With the packages that cibuildwheel installs for them, and no more."""
    if "zig" in compiler:
        pytest.importorskip("ziglang")
    release = SETTINGS["tool"]["cibuildwheel"]
    built = wheel(source, CC=compiler, CFLAGS="")
    programs = environment(tmp_path / "environment", built, *release["test-requires"])
    command = release["test-command"].format(project=shlex.quote(str(source)))
    path = {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": ""}
    done = subprocess.run(
        command, shell=True, cwd=tmp_path, env=os.environ | path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"\d\d passed", done.stdout)


NAMES = "from importlib import metadata; print(*(found.name for found in metadata.distributions()))"


@pytest.mark.slow
@COMPILES
def test_numpy_and_scipy_alone_score_text_files(source, tmp_path, monkeypatch, capsys):
    """With the numbers that the command has where everything is installed, by another build."""
    monkeypatch.chdir(ROOT / "tests/data")
    monkeypatch.delenv("PYTHONPATH", raising=False)
    programs = environment(tmp_path / "environment", wheel(source))

    def run(program, *arguments):
        command = [programs / program, *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    assert sorted(run("python", "-c", NAMES).split()) == ["alignscores", "numpy", "scipy"]
    for name in ("tum", "euroc", "kitti", "nerf"):
        arguments = name, *FILES[name], "--json"
        assert alignscores(arguments) == 0
        ours, theirs = (
            flat(json.loads(printed)["results"])
            for printed in (capsys.readouterr().out, run("alignscores", *arguments))
        )
        assert numbers(theirs) == like(ours)


@pytest.mark.slow
def test_the_container_writes_into_the_working_directory(tmp_path):
    """Not next to its code, which belongs to root."""
    dockerfile = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    entry = re.search("^ENTRYPOINT (.*)$", dockerfile, re.MULTILINE)[1]
    program, *options = json.loads(entry.replace("/alignscores", str(ROOT)))
    target = "quick/trials/rotations.csv", "--config", "trials=1", "results_dir=quick"
    command = [sys.executable, "-m", program, *options, *target]
    subprocess.run(command, cwd=tmp_path, capture_output=True, check=True)
    assert (tmp_path / "quick/trials/rotations.csv").exists()
    assert (tmp_path / ".snakemake").is_dir()
