"""Write the report: ``python -m report [key=value ...]``."""

import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Sequence
from pathlib import Path

from experiments.claims import load_claims, split_replicates
from experiments.command import run_command
from experiments.config import load
from experiments.replicate import FIRST
from experiments.scenarios import BEYOND
from experiments.scenarios import load_study as load_scenarios
from experiments.study import STUDIES, axis_names, load_study
from experiments.tables import write_files

from .inputs import Plan, read_inputs
from .page import render

__all__ = ["main"]

HELP = """\
settings are Hydra overrides, the ones that the workflow was run with; axes of the parameter
studies, such as tas_max_threshold=[0.5,1,1.5]; and replicates=20:
  results_dir=results   where the tables and figures are, and where the page goes

snakemake report makes all that the page needs, and the page
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Write ``<results_dir>/report.html``; return the exit code: 1 for files, 2 for settings."""
    parser = ArgumentParser(
        prog="python -m report",
        description="Write verdicts, figures and evidence on one self-contained page.",
        epilog=HELP,
        formatter_class=RawDescriptionHelpFormatter,
    )
    parser.add_argument("--scenarios", type=Path, default=BEYOND, metavar="FILE")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    plan = _plan(options.overrides, options.scenarios)
    path = plan.results / "report.html"
    write_files({path: render(read_inputs(plan)).encode()})
    return [path]


def _plan(overrides: Sequence[str], scenarios: Path) -> Plan:
    """Tell the settings apart: which concern the claims, the studies' axes, the experiments."""
    n_replicates, others = split_replicates(overrides)
    axes = axis_names()
    settings = [other for other in others if other.partition("=")[0].strip() not in axes]
    return Plan(
        results=Path(load([f"experiment={FIRST}", *settings]).results_dir),
        settings=settings,
        claims=load_claims(n_replicates),
        n_replicates=n_replicates,
        studies={name: load_study(name, others) for name in STUDIES},
        scenarios=load_scenarios(scenarios, settings),
        scenario_file=scenarios,
    )


if __name__ == "__main__":
    sys.exit(main())
