"""Peak memory of one metric in a process of its own: ``python -m benchmarks.memory TAS 10000``."""

import resource
import sys

from .contenders import METRICS, scene

__all__: list[str] = []

if __name__ == "__main__":
    cameras = scene(int(sys.argv[2]), outliers=0.3)
    METRICS[sys.argv[1]](cameras)
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(kilobytes * 1024 if sys.platform != "darwin" else kilobytes)
