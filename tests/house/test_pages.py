"""The code on all pages runs as it stands and prints what they show; the pages name every option.

The blocks of a page run one after the other, in a folder with the files of ``tests/data``:

- ``bash``: every command; see `COMMANDS` for those that would take long or install something
- ``console``: likewise, and what stands below is what it prints
- ``python``: as a program or as a doctest; a ``text`` block behind it is what it prints, and where
  there is none, every line that it prints stands somewhere on the page
- a block that begins with ``# NAME`` is a file: it is written under this name
"""

import doctest
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, fields
from io import StringIO
from pathlib import Path

import matplotlib
import pytest
import yaml

import alignscores as library
import baselines
from alignscores import io as files
from alignscores import metrics
from alignscores.cli import main as alignscores
from experiments.config import EXECUTION, Sweep, load
from experiments.metrics import METRICS, option_names
from experiments.scenes import ERRORS, OUTLIERS, PATHS
from figures.__main__ import main as draw_figures
from tests.snakemake_server import run_snakemake

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(
    [
        *ROOT.glob("*.md"),
        *ROOT.glob(".github/*.md"),
        *DOCS.glob("[!_]*.md"),
        *DOCS.glob("[!_]*/*.md"),
    ]
)
BLOCK = re.compile(r"^( *)```(\w[\w-]*|\{[\w-]+\})[^\n]*\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# ([\w-]+\.(?:yaml|txt)|Snakefile)\n")
RUNS = {"bash", "console", "python", "text", "yaml"}
SHOWN = {
    "{argparse}",
    "{image}",
    "{columns}",
    "{eval-rst}",
    "{literalinclude}",
    "{toctree}",
}  # by Sphinx
SHOWN |= {"py"}  # what needs PyTorch, which the lock is without, or runs from elsewhere


@dataclass(frozen=True)
class Block:
    """A block of code on a page."""

    language: str
    code: str


def blocks(page):
    matches = BLOCK.findall(page.read_text(encoding="utf-8"))
    return [Block(language, code) for _, language, code in matches]


WITH_CODE = [page for page in PAGES if {block.language for block in blocks(page)} & RUNS]


@pytest.mark.slow
@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_code_on_a_page(page, tmp_path, monkeypatch, snakemake):
    for folder in (tmp_path, tmp_path / "tests" / "data"):
        shutil.copytree(ROOT / "tests" / "data", folder, dirs_exist_ok=True)
    (tmp_path / "profiles").symlink_to(ROOT / "profiles")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    text = page.read_text(encoding="utf-8")
    names = {"__name__": "__main__"}
    code_blocks = blocks(page)
    assert {block.language for block in code_blocks} <= RUNS | SHOWN
    for block, following in zip(code_blocks, [*code_blocks[1:], Block("", "")], strict=True):
        if file := FILE.match(block.code):
            Path(file[1]).write_text(block.code)
        if block.language == "yaml":
            assert yaml.safe_load(block.code)
        elif block.language == "python" and block.code.startswith(">>>"):
            run_doctest(block.code, names)
        elif block.language == "python":
            printed = run_python(block.code, names)
            if following.language == "text":
                assert printed == following.code
            else:
                assert [line for line in printed.splitlines() if line not in text] == []
        elif block.language == "console":
            for command, output in sessions(block.code):
                assert run_command(command, snakemake) == output
        elif block.language == "bash":
            run_bash(block.code, snakemake)


def run_python(code, names):
    """Run a program and return what it prints."""
    printed = StringIO()
    with redirect_stdout(printed), matplotlib.rc_context({"backend": "agg"}):
        exec(code, names)
    return printed.getvalue()


def run_doctest(code, names):
    test = doctest.DocTestParser().get_doctest(code, names, "page", None, None)
    assert test.examples
    failures = []
    doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(
        test, out=failures.append, clear_globs=False
    )
    assert not failures, "".join(failures)
    names.update(test.globs)


def sessions(code):
    """Go through the commands behind a dollar, each with what it prints."""
    for part in re.split(r"^\$ ", code, flags=re.MULTILINE)[1:]:
        command, _, output = part.partition("\n")
        yield command, output


def run_bash(code, snakemake):
    """Run the commands of a block; all of it at once where it is a loop."""
    if code.startswith("for "):
        subprocess.run(["bash", "-euo", "pipefail", "-c", code], check=True)
        return
    code = re.sub(r"<< '(\w+)'\n.*?^\1$", "", code.replace("\\\n", " "), flags=re.DOTALL | re.M)
    for line in code.splitlines():
        for command in re.split(r" && | &$", line):
            if shlex.split(command, comments=True):
                run_command(command, snakemake)


def run_command(command, snakemake):
    """Run a command, or check what can be checked of it; return what it prints, errors first."""
    program, *arguments = shlex.split(command, comments=True)
    if "snakemake" in [Path(program).name, *(Path(argument).name for argument in arguments[:1])]:
        snakemake(*arguments[arguments[:1] == [".venv/bin/snakemake"] :])
        return ""
    if program == "alignscores":
        return run_alignscores(arguments)
    check = COMMANDS.get(program, run_other)
    return check([program, *arguments]) or ""


def run_alignscores(arguments):
    """Run the command in this process, with its redirections."""
    out, err, target = StringIO(), StringIO(), None
    if ">" in arguments:
        *arguments, _, target = arguments
    with redirect_stdout(out), redirect_stderr(err), matplotlib.rc_context({"backend": "agg"}):
        assert alignscores(arguments) == 0, err.getvalue()
    if target:
        Path(target).write_text(out.getvalue())
    return err.getvalue() + out.getvalue()


def run_python_program(command):
    """Resolve the settings of an experiment; of other programs check that they are there."""
    _, *arguments = command
    match arguments:
        case ["-m", "venv", ".venv"] | ["-"]:
            pass
        case ["-m", "experiments.run", "--help" | "--cfg", *_]:
            pass
        case ["-m", "experiments.run", "--multirun", *overrides]:
            load([re.sub(r"=([^[,]+),.*", r"=\1", override) for override in overrides])
        case ["-m", "experiments.run", *overrides]:
            load(overrides)
            if overrides[-1].startswith("output=") and "/" not in overrides[-1]:  # it is drawn next
                shorter = [re.sub("^trials=.*", "trials=1", argument) for argument in arguments]
                subprocess.run([sys.executable, *shorter, "n_jobs=1"], check=True)
        case ["-m", "figures", *tables]:
            assert draw_figures(tables) == 0
        case ["-m", "benchmarks", "--against", _]:
            pass  # runs in its own test
        case ["-m", module] | ["-m", "experiments.check" as module, _]:
            assert list(ROOT.glob(f"{module.replace('.', '/')}.py")) or (ROOT / module).is_dir()
        case ["flight/make.py" as script, *_]:
            run_other([sys.executable, script, *arguments[1:]])
        case [script]:
            assert (ROOT / script).is_file(), command
        case _:
            raise AssertionError(f"not known to the tests: {command}")


def check_pip(command):
    """Check that an installation names extras and files that there are."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    assert command[1] == "install"
    for argument in command[2:]:
        if named := re.search(r"\[(.*)\]", argument):
            assert set(named[1].split(",")) <= set(extras)
        elif argument.endswith(".lock"):
            assert (ROOT / argument).exists()


def change_folder(command):
    os.chdir(command[1])


def no_check(command):
    """Leave out what changes the machine, and what CI runs."""


def run_other(command):
    """Run a command, with its redirection."""
    if ">" in command:
        *command, _, target = command
        Path(target).write_bytes(subprocess.run(command, check=True, capture_output=True).stdout)
    else:
        subprocess.run(command, check=True)


COMMANDS = {
    **dict.fromkeys(("python3", ".venv/bin/python"), run_python_program),
    **dict.fromkeys(("pip", ".venv/bin/pip"), check_pip),
    "cd": change_folder,
    **dict.fromkeys(("source", "apt-get", "apptainer", "docker", "sha256sum"), no_check),
    **dict.fromkeys(
        (
            f".venv/bin/{name}"
            for name in ("lint-imports", "mypy", "pytest", "ruff", "sphinx-build")
        ),
        no_check,
    ),
}
"""What is done instead of running a command; whatever is not named here runs."""


@pytest.fixture
def snakemake():
    """Plan what a command would do, as Snakemake's ``--dry-run``, each command once."""

    def plan(*arguments):
        snakefile = ["--snakefile", str(ROOT / "Snakefile")]
        if Path("Snakefile").exists():
            snakefile = []
        elif rule_of(arguments):  # tests/study/workflow plans all of them
            return
        # More replicates are planned alike.
        settings = [argument for argument in arguments if not argument.startswith("replicates=")]
        if "claims" in settings:
            settings += [] if "--config" in settings else ["--config"]
            settings.insert(settings.index("--config") + 1, "replicates=2")
        if tuple(settings) in PLANNED:
            return
        PLANNED.add(tuple(settings))
        log = Path("planned.txt")
        code = run_snakemake([*settings, *snakefile, "--dry-run", "--quiet"], Path.cwd(), log)
        assert code == 0, log.read_text()

    return plan


PLANNED = set()


def rule_of(arguments):
    """Return whether a command names a rule of the Snakefile and nothing else."""
    code = (ROOT / "Snakefile").read_text()
    return len(arguments) == 1 and f"\nrule {arguments[0]}:\n" in code


def test_the_notebook_shows_what_its_cells_give(in_notebook, monkeypatch):
    """Text as it stands; results at the end of a cell are tables."""
    monkeypatch.chdir(DOCS / "how-to")
    cells = json.loads(Path("own_poses.ipynb").read_text())["cells"]
    for command in re.findall(r"^\S+pip .*", "".join(cells[0]["source"]), re.MULTILINE):
        check_pip(shlex.split(command))
    names = {}
    tables = []
    for cell in (entry for entry in cells if entry["cell_type"] == "code"):
        code = "".join(cell["source"]).replace("plt.show()", "plt.close()")
        texts = ["".join(o["text"]) for o in cell["outputs"] if o["output_type"] == "stream"]
        assert run_python(code, names) == "".join(texts)
        for output in cell["outputs"]:
            if output["output_type"] == "execute_result":
                value = eval(code.splitlines()[-1], names)
                assert output["data"]["text/plain"] == [repr(value)]
                tables.append(in_notebook(value))
    assert ["<table" in table for table in tables] == [True, True]


def test_the_table_of_metrics_has_every_name():
    page = (DOCS / "reference" / "metrics.md").read_text()
    cells = re.findall(r"^\| (`[^|]*) \|", page, re.MULTILINE)
    named = re.findall(r"`([^`]+)`", " ".join(cells))
    others = [entry.syntax for entry in metrics.METRICS if entry.name not in metrics.SCORES]
    assert sorted(named) == sorted(others)


def test_the_settings_have_every_name():
    page = (DOCS / "reference" / "settings.md").read_text()
    options = {option for name in METRICS for option in option_names(name)}
    settings = {key.name for key in fields(Sweep)} - {"name", "changes", "selections"}
    for name in {*settings, *EXECUTION, *METRICS, *options, *PATHS, *ERRORS, *OUTLIERS}:
        assert f"`{name}`" in page, name


def test_all_that_is_public_is_shown():
    """What docs/reference/index.md calls public, other projects' metrics and the paper's."""
    page = (DOCS / "reference" / "api.md").read_text()
    shown = set(re.findall(r"^   ([\w.]+)$", page, re.MULTILINE))
    for prefix, names in {
        "metrics.": [public for public in metrics.__all__ if callable(getattr(metrics, public))],
        "io.": [public for public in files.__all__ if public.startswith("read_")],
        "": [*library.__all__, *baselines.__all__],
    }.items():
        assert {prefix + name for name in names} <= shown


def test_the_result_files_have_every_column(tmp_path, monkeypatch):
    """Columns of your own trajectories; the docstrings have the study's."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "tests" / "data" / "tum", "tum")
    page = (DOCS / "reference" / "results.md").read_text()
    files = "tum/reference.txt", "tum/estimate.txt", "tum/reference.txt"
    scored = json.loads(run_alignscores(["tum", *files, "--json", "--save_errors=errors.csv"]))
    names = {*scored["results"][0], *scored["results"][0]["alignment"]}
    names |= {*Path("errors.csv").read_text().splitlines()[0].split(",")}
    patterns = "tum/reference.txt", "tum/{system}.txt"
    compared = json.loads(run_alignscores(["compare", "tum", *patterns, "--jobs=1", "--json"]))
    for part in ("runs", "summary", "pairs"):
        keys = {key for entry in compared[part] for key in entry}
        names |= {re.sub(r"_(all|sd|scored)$", "", key) for key in keys}
    assert {name for name in names if f"`{name}`" not in page} == set()
