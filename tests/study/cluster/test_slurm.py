"""The profile for SLURM, in a cluster of one node that lives for one test: `pytest -m cluster`."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
ONE_NODE_SLURM = Path(__file__).with_name("one-node-slurm")
REPLICATES = 2

pytestmark = [
    pytest.mark.cluster,
    pytest.mark.skipif(shutil.which("sbatch") is None, reason="needs slurm-wlm and munge"),
]


def test_replicates_are_jobs_with_stated_needs_and_the_bytes_of_a_serial_run(tmp_path):
    def snakemake(profile, *options):
        paths = ["--snakefile", str(ROOT / "Snakefile"), "--profile", str(ROOT / profile)]
        config = ["--config", f"replicates={REPLICATES}", "trials=2", *options]
        return [sys.executable, "-m", "snakemake", "claims", *paths, *config]

    submitted = [
        *snakemake("profiles/slurm", "results_dir=out"),
        # This cluster keeps no accounts, and jobs end soon.
        *["--slurm-status-command", "squeue", "--slurm-init-seconds-before-status-checks", "2"],
    ]
    # The limit is inside, so that the cluster is ended in any case.
    script = 'timeout --kill-after=5 90 "$@" && scontrol show jobs --oneliner > jobs.txt'
    done = subprocess.run(
        [ONE_NODE_SLURM, "bash", "-c", script, "bash", *submitted],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr

    lines = (tmp_path / "jobs.txt").read_text().splitlines()
    jobs = [dict(pair.partition("=")[::2] for pair in line.split()) for line in lines]
    expected = {"NumCPUs": "1", "MinMemoryNode": "902M", "TimeLimit": "00:11:00"}
    expected |= {"JobState": "COMPLETED", "WorkDir": str(tmp_path)}
    assert [{key: job[key] for key in expected} for job in jobs] == [expected] * REPLICATES

    serial = snakemake("profiles/default", "results_dir=serial", "n_jobs=1")
    subprocess.run(serial, cwd=tmp_path, check=True, capture_output=True)
    for name in ("claims.csv", *(f"replicates/{number}.csv" for number in range(REPLICATES))):
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "serial" / name).read_bytes()
