"""Measure today's protocols as the other metrics: ``python -m benchmarks.protocols``."""

import argparse
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from threadpoolctl import threadpool_limits
from tqdm import tqdm

from experiments.tables import write_files

from .__main__ import Times, machine, markdown, measure, milliseconds, peak_memory
from .contenders import protocol_value, scene
from .memory import STATUS

__all__: list[str] = []

# The largest number of cameras that each is measured with.
LARGEST = {
    "auc@30:vggt": 10_000,
    "auc@30:da3": 10_000,
    "auc@5:colmap": 10_000,
    "recall@5cm,5deg:hloc-sim3": 10_000,
    "ate:rmse": 10_000,
    "rpe@1m": 10_000,
    "kitti": 10_000,
    "rpg@100m": 10_000,
}
SIZES = (10, 30, 100, 1000, 10_000)


PAGE = """\
# Benchmarks of the protocols

Written by `python -m benchmarks.protocols`: milliseconds against the number of
cameras (a cube, 30 % outliers, 3 cm and 3 degrees of noise), and the largest
resident size of a process that evaluates the protocol once, Python and its libraries
included. The shortest processor time counts. One core, BLAS on one thread, seed 0.

Machine: {machine}.

{table}
"""


def main() -> int:
    """Measure all protocols up to a number of cameras and write the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.protocols",
        description="Measure times and memory of the protocols; write protocol-benchmarks.md.",
    )
    parser.add_argument("--output", type=Path, default=Path("docs"), help="folder (docs)")
    parser.add_argument("--largest", type=int, default=SIZES[-1], help="number of cameras (10000)")
    options = parser.parse_args()
    sizes = [n for n in SIZES if n <= options.largest]
    with threadpool_limits(limits=1):
        times = {n: measure(calls(n)) for n in tqdm(sizes, disable=None)}
    memory: Times = {}
    if STATUS.exists():
        memory = {name: peak_memory(name, min(sizes[-1], most)) for name, most in LARGEST.items()}
    page = options.output / "reference" / "protocol-benchmarks.md"
    write_files({page: report(times, memory).encode()})
    print(page)
    return 0


def calls(n_cameras: int) -> dict[str, Callable[[], object]]:
    """Return what is measured with a number of cameras, by its name."""
    cameras = scene(n_cameras, outliers=0.3)
    return {
        name: partial(protocol_value, name, cameras)
        for name, most in LARGEST.items()
        if n_cameras <= most
    }


def report(times: dict[int, Times], memory: Times) -> str:
    """Return the page with the table."""
    sizes = list(times)
    heads = ["protocol", *(f"{n:,}" for n in sizes), "MiB", "with cameras"]
    rows = [
        [
            f"`{name}`",
            *(milliseconds(times[n][name]) if name in times[n] else "–" for n in sizes),
            *((f"{memory[name]:.0f}", f"{min(sizes[-1], most):,}") if memory else ("–", "–")),
        ]
        for name, most in LARGEST.items()
    ]
    return PAGE.format(machine=machine(), table=markdown(heads, rows))


if __name__ == "__main__":
    sys.exit(main())
