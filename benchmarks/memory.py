"""Peak memory of one metric in a process of its own: ``python -m benchmarks.memory TAS 10000``.

The metrics of the benchmarks, and today's protocols by their names. In MiB, out of Linux's
``/proc``. (The ``ru_maxrss`` of a process starts with its parent's.)
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
