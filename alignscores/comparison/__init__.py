"""Systems over sequences and runs, and which of them are ahead: `compare`.

`patterns` and `benchmark` find the runs, `runs` scores them, `summary` compares the systems by the
tests of `statistics`, `verdict` puts that in words and `tables` in tables; `baseline` and `gate`
compare with a saved comparison.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .comparison import Comparison, compare

__all__ = ["Comparison", "compare"]


def __getattr__(name: str) -> object:
    """Import pandas only where a comparison is made: workers that score do without."""
    if name in __all__:
        from . import comparison

        return getattr(comparison, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
