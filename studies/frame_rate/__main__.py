"""Score trajectories at several frame rates: ``python -m studies.frame_rate FILE.yaml``."""

import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Sequence
from pathlib import Path

from experiments.command import run_command
from experiments.tables import to_csv, write_files

from .trajectories import read_recordings, score_rates

HELP = """\
the file, with paths relative to it:
  KITTI 00:
    format: kitti
    reference: 00_gt.txt
    estimates: {ORB-SLAM: 00_orb.txt, S-PTAM: 00_sptam.txt}
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Score the trajectories of a file; return the exit code."""
    parser = ArgumentParser(
        prog="python -m studies.frame_rate",
        description="Score trajectories with each camera kept, each second, each fifth, and so on.",
        epilog=HELP,
        formatter_class=RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", type=Path, metavar="FILE.yaml", help="which trajectories")
    parser.add_argument("--output", type=Path, required=True, metavar="FILE.csv")

    def work(options: Namespace) -> list[Path]:
        write_files({options.output: to_csv(score_rates(read_recordings(options.file)))})
        return [options.output]

    return run_command(parser, work, arguments)


if __name__ == "__main__":
    sys.exit(main())
