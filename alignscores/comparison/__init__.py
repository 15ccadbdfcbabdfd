"""Systems over sequences and runs, with their uncertainty: `compare`.

`patterns` and `benchmark` find the runs, `runs` scores them, `summary` takes their means, with
the statistics of `intervals`; `tables` shows them.
"""

from .comparison import Comparison, compare

__all__ = ["Comparison", "compare"]
