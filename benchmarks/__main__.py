"""Measure, and write table and plot: ``python -m benchmarks``.

All contenders on a scene take turns, so that what else the machine does hits them alike, and the
shortest processor time counts. One core: BLAS runs on one thread.
"""

import argparse
import contextlib
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import scipy
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from experiments.tables import write_files
from figures import style

from .contenders import METRICS, PROFILE, REFINED, UNCOMPILED, contenders
from .floor import compiled_loop
from .memory import STATUS

__all__: list[str] = []

Times = dict[str, float]

SIZES = (10, 100, 1000, 10_000, 100_000)
MEMORY_SIZES = (10_000, 100_000)
SCENES = [*((n, 0.3) for n in SIZES), (100, 0.9)]
SHORTEST = 0.02  # seconds; what is quicker is called several times a turn
BUDGET = 1.0  # seconds a contender and scene, but at least one call
MAX_TURNS = 20


REGISTRATION = ["TAS", "pycolmap", "TAS / pycolmap", "floor", "TAS / floor", UNCOMPILED]
REFINEMENT = ["TAS", REFINED, f"{REFINED} / TAS", PROFILE]
PAGE = """\
# Benchmarks

Written by `python -m benchmarks`, which takes some minutes, most of them for the
mAA of 100,000 cameras. All contenders on a scene take turns and the shortest
processor time counts; ratios mean more than times. One core, BLAS on one thread.

Machine: {machine}.

## Time

Milliseconds, with 30 % outliers.

{metrics}

![Time against the number of cameras](../images/benchmarks.png)

## Registration

TAS (validation, d, 1000 hypotheses, score; milliseconds) beside pycolmap's
`estimate_sim3d_robust` with 1000 trials, and beside the floor: a compiled loop that
counts the inliers of 1000 given hypotheses
([floor.c](../../benchmarks/floor.c)). Last, the TAS as it is where the installation
found no C compiler: NumPy alone, same bits.
A dash: pycolmap (extra `bench`) or a C compiler was not there.

{registration}

The refined registration, and the profile of 64 units with the half-score distance:

{refined}

## Peak memory

MiB resident in a process that evaluates the metric once, Python and its libraries
included, with 30 % outliers.

{memory}
"""


def main() -> int:
    """Measure everything up to a number of cameras and write table and plot."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description="Measure times and memory of the metrics; write benchmarks.md and a plot.",
    )
    parser.add_argument("--output", type=Path, default=Path("docs"), help="folder (docs)")
    parser.add_argument("--largest", type=int, default=SIZES[-1], help="number of cameras (100000)")
    options = parser.parse_args()
    floor = compiled_loop()
    results: dict[tuple[int, float], Times] = {}
    with threadpool_limits(limits=1):
        for n, outliers in tqdm([s for s in SCENES if s[0] <= options.largest], disable=None):
            results[n, outliers] = measure(contenders(n, outliers, floor))
    sizes = [n for n in MEMORY_SIZES if n <= options.largest and STATUS.exists()]
    memory = {n: {name: peak_memory(name, n) for name in METRICS} for n in sizes}
    table = options.output / "reference" / "benchmarks.md"
    picture = options.output / "images" / "benchmarks.png"
    write_files({table: report(results, memory).encode(), picture: plot(results)})
    print(table)
    return 0


def measure(calls: dict[str, Callable[[], object]]) -> Times:
    """Return the shortest time of each, in seconds a call; they take turns."""
    first = {name: clock(call, 1) for name, call in calls.items()}  # warms up, too
    repeats = {name: max(1, round(SHORTEST / seconds)) for name, seconds in first.items()}
    turns = {
        name: min(MAX_TURNS, int(BUDGET / (repeats[name] * seconds)))
        for name, seconds in first.items()
    }
    best = {name: seconds for name, seconds in first.items() if turns[name] == 0}
    for turn in range(max(turns.values())):
        for name, call in calls.items():
            if turn < turns[name]:
                best[name] = min(best.get(name, np.inf), clock(call, repeats[name]))
    return best


def clock(call: Callable[[], object], repeats: int) -> float:
    """Return the mean processor time of a call in seconds."""
    start = time.process_time()
    for _ in range(repeats):
        call()
    return (time.process_time() - start) / repeats


def peak_memory(metric: str, n: int) -> float:
    """Return the largest resident size in MiB of a process that evaluates one metric once."""
    command = [sys.executable, "-m", "benchmarks.memory", metric, str(n)]
    return float(subprocess.run(command, check=True, capture_output=True).stdout)


def report(results: dict[tuple[int, float], Times], memory: dict[int, Times]) -> str:
    """Return the page with the tables."""
    usual = [([f"{n:,}"], times) for (n, outliers), times in results.items() if outliers == 0.3]
    scenes = [([f"{n:,}", f"{outliers:.0%}"], times) for (n, outliers), times in results.items()]
    peaks = [[f"{n:,}", *(f"{peak[name]:.0f}" for name in METRICS)] for n, peak in memory.items()]
    return PAGE.format(
        machine=machine(),
        metrics=times_table(["cameras"], [*METRICS], usual),
        registration=times_table(["cameras", "outliers"], REGISTRATION, scenes),
        refined=times_table(["cameras", "outliers"], REFINEMENT, scenes),
        memory=markdown(["cameras", *METRICS], peaks),
    )


def times_table(
    keys: list[str], columns: Sequence[str], scenes: list[tuple[list[str], Times]]
) -> str:
    """Return a table of times, and of ratios in columns such as "TAS / floor"."""
    rows = [[*scene, *(_cell(times, column) for column in columns)] for scene, times in scenes]
    return markdown([*keys, *columns], rows)


def _cell(times: Times, column: str) -> str:
    """Return a time or a ratio of two; a dash where a contender was not there."""
    names = column.split(" / ")
    if not times.keys() >= set(names):
        return "–"
    seconds = [times[name] for name in names]
    return milliseconds(*seconds) if len(seconds) == 1 else f"{seconds[0] / seconds[1]:.2f}"


def milliseconds(seconds: float) -> str:
    """Write a time in milliseconds with three digits."""
    value = 1e3 * seconds
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def markdown(head: list[str], rows: list[list[str]]) -> str:
    """Return a table whose columns are aligned to the right."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["--:"] * len(head), *rows))


def machine() -> str:
    """Describe processor and software."""
    processor = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
        processor = names[0].split(":")[1].strip() if names else processor
    packages = [f"NumPy {np.__version__}", f"SciPy {scipy.__version__}"]
    with contextlib.suppress(PackageNotFoundError):
        packages.append(f"pycolmap {version('pycolmap')}")
    return ", ".join([processor, f"Python {platform.python_version()}", *packages])


@style.applied()
def plot(results: dict[tuple[int, float], Times]) -> bytes:
    """Draw times against the number of cameras, both logarithmic; return the PNG."""
    usual = {n: times for (n, outliers), times in results.items() if outliers == 0.3}
    figure, axes = plt.subplots(figsize=(style.COLUMN, 2.6), layout="constrained")
    sizes = list(usual)
    others = [name for name in ("pycolmap", "floor") if all(name in t for t in usual.values())]
    lines: dict[str, Any] = dict(
        zip(METRICS, style.colours("n_cameras", len(METRICS) + 1), strict=False)
    )
    ends = []
    for name in [*METRICS, *others]:
        values = [1e3 * usual[n][name] for n in sizes]
        colour = lines.get(name, style.FAINT)
        axes.loglog(sizes, values, color=colour, linestyle="-" if name in METRICS else "--")
        ends.append((values[-1], name, colour))
    low, high = axes.get_ylim()
    gap = (high / low) ** 0.05
    height = 0.0
    for value, name, colour in sorted(ends, key=lambda end: end[0]):
        height = max(value, height * gap)  # labels do not overlap
        axes.annotate(
            *(name, (sizes[-1], height), (3, 0)),
            textcoords="offset points",
            va="center",
            fontsize=style.SMALL,
            color=colour,
        )
    axes.set_xlabel("number of cameras")
    axes.set_ylabel("milliseconds")
    axes.margins(x=0.02)
    buffer = BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    plt.close(figure)
    return buffer.getvalue()


if __name__ == "__main__":
    sys.exit(main())
