"""Types of the arrays that the whole project works with."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["Booleans", "Floats", "Indices"]

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Booleans = NDArray[np.bool_]
