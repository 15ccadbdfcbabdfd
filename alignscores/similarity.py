"""Similarity transformations from the ground-truth world to the estimated world."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Similarity"]


@dataclass(frozen=True, eq=False)
class Similarity:
    """Similarity that takes ground-truth positions to estimated positions.

    A camera at ``c`` in the ground-truth world is expected at
    ``scale * rotation @ c + translation`` in the estimated world.

    Parameters
    ----------
    scale : float
        Estimated units per ground-truth unit, positive.
    rotation : (3, 3) ndarray
        Rotation from the ground-truth world to the estimated world.
    translation : (3,) ndarray
        Position of the ground-truth origin in the estimated world, in estimated units.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import Similarity
    >>> twice = Similarity(2.0, np.eye(3), np.array([1.0, 0.0, 0.0]))
    >>> twice.apply(np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]))
    array([[1., 0., 0.],
           [3., 2., 2.]])
    """

    scale: float
    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]

    def apply(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Take ground-truth positions to the estimated world.

        Parameters
        ----------
        positions : (n, 3) array
            Positions in the ground-truth world.

        Returns
        -------
        (n, 3) ndarray
            The positions in the estimated world.
        """
        return self.scale * positions @ self.rotation.T + self.translation

    def position_errors(
        self, gt_positions: NDArray[np.float64], est_positions: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Distance between each estimated position and its ground truth after the alignment.

        Parameters
        ----------
        gt_positions, est_positions : (n, 3) array
            Positions in the ground-truth and in the estimated world.

        Returns
        -------
        (n,) ndarray
            ``|| (est - translation) / scale - rotation @ gt ||`` in ground-truth units.
        """
        with np.errstate(over="ignore"):  # farther than the largest number: infinitely far
            aligned = (est_positions - self.translation) / self.scale
            errors: NDArray[np.float64] = np.linalg.norm(
                aligned - gt_positions @ self.rotation.T, axis=1
            )
        return errors
