"""Snakemake with the project's workflow, in an empty working directory and with an empty home."""

import re
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import pytest

from tests.snakemake_server import copied_project, run_snakemake

ROOT = Path(__file__).resolve().parents[3]
SNAKEFILE = ROOT / "Snakefile"


@dataclass(frozen=True)
class Done:
    """Output of a call of Snakemake and, after a dry run, its plan."""

    returncode: int | None
    text: str

    @property
    def planned(self):
        """Jobs of a dry run by rule; none where there is nothing to do."""
        assert self.returncode == 0, self.text
        if "Nothing to be done" in self.text:
            return {}
        lines = self.text.splitlines()
        start = lines.index("Job stats:")
        rows = [line.split() for line in takewhile(str.strip, lines[start + 3 :])]
        jobs = {row[0]: int(row[1]) for row in rows if len(row) == 2 and row[1].isdigit()}
        assert jobs.pop("total") == sum(jobs.values())
        return jobs

    @property
    def jobs(self):
        """The rule and the description of each job."""
        return re.findall(r"^(?:local)?rule (\w+):\n((?: +.*\n)+)", self.text, re.MULTILINE)


def options(project=ROOT, profile="default"):
    chosen = ["--snakefile", str(project / "Snakefile")]
    return [*chosen, "--profile", str(ROOT / "profiles" / profile)]


@pytest.fixture
def snakemake(tmp_path):
    runs = {ROOT: run_snakemake}
    with ExitStack() as stack:

        def run(*arguments, project=ROOT, profile="default"):
            if project not in runs:
                runs[project] = stack.enter_context(copied_project(project))
            folder = tmp_path if project == ROOT else project
            log = tmp_path / "snakemake.log"
            code = runs[project]([*options(project, profile), *arguments], folder, log)
            return Done(code, log.read_text())

        yield run
