"""Systems over sequences and runs, and which of them are ahead: `compare`.

`patterns` and `benchmark` find the runs, `runs` scores them, `summary` compares the systems by the
tests of `statistics`; `verdicts` and `tables` show them, `baseline` and `gate` compare with a saved
comparison.
"""

from .comparison import Comparison, compare

__all__ = ["Comparison", "compare"]
