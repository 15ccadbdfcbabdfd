"""What is too large or too slow for the tests: ``python tests/hostile.py [CASE ...]``.

A line for each case: what is expected, what happened, seconds of the processor, and MB of the
largest program. The exit code is 1 where one went wrong. Linux only.
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
LINES = 10**6
LINE = "%d 1 2 3 0 0 0 1\n"
BOMB = "a0: &a0 [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"a{n}: &a{n} [{','.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 9)
)
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


class Programs:
    """Runs programs in a folder, and knows what time and memory they took."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.seconds, self.megabytes = folder, 0.0, 0.0

    def run(
        self, *command: str, until: float | None = None, end: int = signal.SIGINT
    ) -> tuple[int, str]:
        """Return the exit code and what was said; of one with its children, ended after a time."""
        with tempfile.TemporaryFile() as file:
            process = subprocess.Popen(
                command,
                cwd=self.folder,
                env=os.environ | {"OMP_NUM_THREADS": "1", "XDG_CACHE_HOME": str(self.folder)},
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=file,
                start_new_session=True,
            )
            if until is not None:
                time.sleep(until)
                os.killpg(process.pid, end)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            file.seek(0)
            said = file.read().decode()
        self.seconds += usage.ru_utime + usage.ru_stime
        self.megabytes = max(self.megabytes, usage.ru_maxrss / 1000)
        return process.returncode, said

    def write(self, name: str, content: bytes | str) -> str:
        path = self.folder / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return str(path)


Outcome = tuple[bool, str]  # whether it went right, what happened
Case = Callable[[Programs], Outcome]


def refused(programs: Programs, *arguments: str) -> Outcome:
    """One line, the exit code of wrong input and less than a gigabyte."""
    code, said = programs.run(*COMMAND, *arguments)
    line = said.strip()
    right = code in (1, 2) and "\n" not in line and programs.megabytes < 1000
    return right, f"exit code {code}: {line[-100:]}"


def gzip_bomb(programs: Programs) -> Outcome:
    path = programs.folder / "bomb.gz"
    with gzip.open(path, "wb") as file:
        for _ in range(1000):
            file.write(b"\n" * 10**6)
    return refused(programs, "tum", str(TUM / "reference.txt"), str(path))


def endless(programs: Programs) -> Outcome:
    return refused(programs, "tum", str(TUM / "reference.txt"), "/dev/zero")


def alias_bomb(programs: Programs) -> Outcome:
    return refused(programs, "compare", programs.write("x.yaml", BOMB))


def nested(programs: Programs) -> Outcome:
    return refused(programs, "compare", programs.write("x.yaml", "[" * 30_000))


def nested_scenarios(programs: Programs) -> Outcome:
    programs.write("x.yaml", "[" * 30_000)
    code, said = programs.run(*SNAKEMAKE, *PROFILE, "beyond", "--config", "scenarios=x.yaml")
    (line,) = [line for line in said.splitlines() if line.startswith("snakemake: ")] or [said]
    return code == 1 and line != said, f"exit code {code}: {line[-100:]}"


def million_lines(programs: Programs) -> Outcome:
    path = programs.write("long.txt", "".join(LINE % n for n in range(LINES)))
    code, said = programs.run(*COMMAND, "tum", path, path, "--unit", "1")
    return code == 0 and programs.megabytes < 2000, f"exit code {code}: {said.split()[-6:]}"


def interrupted(programs: Programs) -> Outcome:
    files = str(TUM / "reference.txt"), str(TUM / "{system}.txt")
    codes = []
    for moment in range(20):
        code, said = programs.run(
            *(*COMMAND, "compare", "tum", *files, "--no_cache"), until=0.1 * moment
        )
        if "Failed to import the site module" not in said:  # before any of our code
            codes.append(code)
        if code == 130 and said.count("\n") > 1:
            return False, said[-200:]
    right = 130 in codes and set(codes) <= {0, 130, -signal.SIGINT}
    return right, f"exit codes {sorted(set(codes))}"


def killed(programs: Programs) -> Outcome:
    settings = "--cores", "1", "--config", "trials=1"
    figures = *SNAKEMAKE, *PROFILE, "figures", *settings
    for moment in (20, 40, 60):
        programs.run(*figures, "results_dir=killed", until=moment, end=signal.SIGKILL)
    codes = [programs.run(*figures, f"results_dir={name}")[0] for name in ("killed", "whole")]
    tables = [
        {path.name: path.read_bytes() for path in (programs.folder / name).rglob("*.csv")}
        for name in ("killed", "whole")
    ]
    same = tables[0] == tables[1] and len(tables[0]) > 0
    return codes == [0, 0] and same, f"{len(tables[0])} tables, {'same' if same else 'other'} bytes"


def memory(script: str, most: float) -> Case:
    def run(programs: Programs) -> Outcome:
        code, said = programs.run(sys.executable, "-c", POSES + script)
        return code == 0 and float(said) <= most, f"{said.strip()[:4]} times the input beside it"

    return run


CASES: dict[str, tuple[str, Case]] = {
    "gzip_bomb": ("1 MB that unpacks to 1 GB: one line", gzip_bomb),
    "endless": ("/dev/zero: one line", endless),
    "alias_bomb": ("aliases for 9^9 entries: one line", alias_bomb),
    "nested": ("30 kB of brackets in a benchmark: one line", nested),
    "nested_scenarios": ("the same as scenarios of the study: one line", nested_scenarios),
    "million_lines": ("a million poses: scored in less than 2 GB", million_lines),
    "interrupted": ("Ctrl-C at 20 moments: one line, 130", interrupted),
    "killed": ("kill -9 thrice during the figures: same bytes in the end", killed),
    "pas": ("a million poses: at most twice the input beside it", memory(PAS, 2)),
    "tas_profile": ("likewise", memory(TAS_PROFILE, 2)),
}


def main(names: list[str]) -> int:
    """Run cases, by default all; return the exit code."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it in the background
    wrong = 0
    for name in names or CASES:
        expected, case = CASES[name]
        with tempfile.TemporaryDirectory() as folder:
            programs = Programs(Path(folder))
            right, happened = case(programs)
        wrong += not right
        cells = (
            name,
            expected,
            happened,
            f"{programs.seconds:.0f} s",
            f"{programs.megabytes:.0f} MB",
        )
        print("right" if right else "WRONG", *cells, sep=" | ", flush=True)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
