"""Peak memory in MiB of one metric in its own process: ``python -m benchmarks.memory TAS 10000``.

It is read from Linux's ``/proc``; the ``ru_maxrss`` of a process starts with its parent's.
"""

import sys
from pathlib import Path

from .contenders import METRICS, protocol_value, scene

__all__ = ["STATUS"]

STATUS = Path("/proc/self/status")

if __name__ == "__main__":
    cameras = scene(int(sys.argv[2]), outliers=0.3)
    name = sys.argv[1]
    METRICS[name](cameras) if name in METRICS else protocol_value(name, cameras)
    (line,) = (line for line in STATUS.read_text().splitlines() if line.startswith("VmHWM"))
    print(int(line.split()[1]) / 1024)
