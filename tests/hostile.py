"""What is too large or too slow for the tests: ``python tests/hostile.py [CASE ...]``.

A line for each case: what is expected, and what happened. The exit code is 1 where one went wrong.
Linux only.
"""

import gzip
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TUM = ROOT / "tests" / "data" / "tum"
COMMAND = sys.executable, "-m", "alignscores"
SNAKEMAKE = sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile")
PROFILE = "--profile", str(ROOT / "profiles" / "default")
LINE = "%d 1 2 3 0 0 0 1\n"
POSES = """
from pathlib import Path
import numpy as np
from scipy.spatial.transform import Rotation
from alignscores import pas, tas_profile
def kilobytes(key):
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(key))
rng, n = np.random.default_rng(0), 10**6
gt = np.tile(np.eye(4), (n, 1, 1))
gt[:, :3, :3] = Rotation.random(n, rng=rng).as_matrix()
gt[:, :3, 3] = 100 * rng.random((n, 3))
est = gt.copy()
turns = Rotation.from_rotvec(rng.normal(scale=0.03, size=(n, 3)))
est[:, :3, :3] = turns.as_matrix() @ gt[:, :3, :3]
est[:, :3, 3] += rng.normal(scale=0.1, size=(n, 3))
est[::10] = gt[5::10]
def measure(score, *worlds):
    score(*(world[:100] for world in worlds))
    Path("/proc/self/clear_refs").write_text("5")
    before = kilobytes("VmRSS")
    score(*worlds)
    print((kilobytes("VmHWM") - before) * 1024 / sum(world.nbytes for world in worlds))
"""
PAS = "measure(pas, gt, est)"
TAS_PROFILE = """
measure(lambda gt, est: tas_profile(gt[:, :3, 3], est[:, :3, 3]), gt, est)
"""

Outcome = tuple[bool, str]  # whether it went right, what happened
Case = Callable[[Path], Outcome]


def run(folder: Path, *command: str, until: float | None = None) -> tuple[int, str, float]:
    """Return the exit code, what was said and the MB that it took; killed after a time."""
    with tempfile.TemporaryFile() as file:
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=file,
            start_new_session=True,
        )
        if until is not None:
            time.sleep(until)
            os.killpg(process.pid, signal.SIGKILL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        file.seek(0)
        return process.returncode, file.read().decode(), usage.ru_maxrss / 1000


def gzip_bomb(folder: Path) -> Outcome:
    path = folder / "bomb.gz"
    with gzip.open(path, "wb") as file:
        for _ in range(1000):
            file.write(b"\n" * 10**6)
    code, said, megabytes = run(folder, *COMMAND, "tum", str(TUM / "reference.txt"), str(path))
    line = said.strip()
    return code == 1 and "\n" not in line and megabytes < 1000, f"exit code {code}: {line[-100:]}"


def million_lines(folder: Path) -> Outcome:
    path = folder / "long.txt"
    path.write_text("".join(LINE % n for n in range(10**6)))
    code, said, megabytes = run(folder, *COMMAND, "tum", str(path), str(path), "--unit", "1")
    return code == 0 and megabytes < 2000, f"exit code {code}, {megabytes:.0f} MB: {said[-60:]}"


def killed(folder: Path) -> Outcome:
    figures = *SNAKEMAKE, *PROFILE, "figures", "--cores", "1", "--config", "trials=1"
    for moment in (20, 40, 60):
        run(folder, *figures, "results_dir=killed", until=moment)
    codes = [run(folder, *figures, f"results_dir={name}")[0] for name in ("killed", "whole")]
    tables = [
        {path.name: path.read_bytes() for path in (folder / name).rglob("*.csv")}
        for name in ("killed", "whole")
    ]
    same = tables[0] == tables[1] and len(tables[0]) > 0
    return codes == [0, 0] and same, f"{len(tables[0])} tables, {'same' if same else 'other'} bytes"


def memory(script: str) -> Case:
    def case(folder: Path) -> Outcome:
        code, said, _ = run(folder, sys.executable, "-c", POSES + script)
        return code == 0 and float(said) <= 2, f"{said.strip()[:4]} times the input beside it"

    return case


CASES: dict[str, tuple[str, Case]] = {
    "gzip_bomb": ("1 MB that unpacks to 1 GB: one line", gzip_bomb),
    "million_lines": ("a million poses: scored in less than 2 GB", million_lines),
    "killed": ("kill -9 thrice during the figures: same bytes in the end", killed),
    "pas": ("a million poses: at most twice the input beside it", memory(PAS)),
    "tas_profile": ("likewise", memory(TAS_PROFILE)),
}


def main(names: list[str]) -> int:
    """Run cases, by default all; return the exit code."""
    wrong = 0
    for name in names or CASES:
        expected, case = CASES[name]
        with tempfile.TemporaryDirectory() as folder:
            right, happened = case(Path(folder))
        wrong += not right
        print("right" if right else "WRONG", name, expected, happened, sep=" | ", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
