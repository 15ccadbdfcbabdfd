"""Draw the pictures of README, the first page and Start, from the flight in ``tests/data``.

``python docs/images/make.py [FOLDER]`` writes them next to this script, or to another folder.
``snakemake figures`` and the studies draw the others; here they are reduced to 256 colours.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from alignscores import evaluate, plot
from alignscores.cli import main

FLIGHT = Path(__file__).parents[2] / "tests" / "data" / "flight"


def draw(folder):
    """Write the pictures of one estimate and of a comparison."""
    evaluation = evaluate(FLIGHT / "groundtruth.txt", FLIGHT / "vio.txt")
    for name in ("trajectory", "scores", "errors"):
        plot(evaluation, name).savefig(folder / f"{name}.png", dpi=130)
    plot(evaluation).savefig(folder / "start.png", dpi=90)
    with tempfile.TemporaryDirectory() as runs:
        subprocess.run([sys.executable, FLIGHT / "make.py", "runs", runs], check=True)
        reference, estimates = "{sequence}/groundtruth.txt", "{sequence}/{system}/{run}.txt"
        patterns = f"{runs}/{reference}", f"{runs}/{estimates}"
        main(["compare", "tum", *patterns, "--save_plot", str(folder / "comparison.png")])


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
