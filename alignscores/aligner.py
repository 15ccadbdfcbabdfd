"""Alignment of estimated camera positions with the ground truth, at any largest threshold."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .registration import REGISTRATIONS, Registration, refined
from .registration.refined import Search
from .similarity import FARTHEST_SUMMABLE, Similarity, check_alignment
from .validation import check_positions, check_positive, check_same_length, finite_rows

__all__ = ["Aligned", "Aligner", "Normalised", "Seed", "normalise"]

Normalised = tuple[Floats, Floats, float]  # positions, their origin and unit; see `normalise`
Seed = int | np.random.SeedSequence | np.random.Generator | None

ROUNDING = 1e-6  # by which a scale may differ from 1
IDENTITY = Similarity(1.0, np.eye(3), np.zeros(3))


class Aligned(NamedTuple):
    """An alignment, None where there is none, the errors (n,), and how many it was chosen from."""

    alignment: Similarity | None
    errors: Floats
    n_hypotheses: int


class Aligner:
    """Checks positions once, and aligns them at one or several largest thresholds.

    The arguments are those of `tas`. The refined registration draws its hypotheses once, and what
    it finds at one threshold is a start at the next.
    """

    def __init__(
        self,
        gt_positions: ArrayLike,
        est_positions: ArrayLike,
        *,
        registration: str | Registration,
        rng: Seed,
        n_hypotheses: int,
        alignment: str,
        up: str,
    ) -> None:
        self.gt = check_positions(gt_positions, "gt_positions", complete=True)
        self.est = check_positions(est_positions, "est_positions", complete=False)
        check_same_length(self.gt, self.est, "gt_positions", "est_positions")
        check_positive(n_hypotheses, "n_hypotheses", integer=True)
        check_alignment(alignment, up)
        self._register, self.registration = _registration(registration)
        try:
            np.random.default_rng(rng)
        except (TypeError, ValueError) as error:
            raise ValueError(f"rng must be a seed or a Generator, not {rng!r}: {error}") from None
        self._rng, self._n_hypotheses, self._alignment = rng, int(n_hypotheses), alignment
        self.normalised_gt = normalise(self.gt)
        self.estimated = finite_rows(self.est)
        self._axes = np.roll(range(3), -1 - "xyz".index(up[-1]))  # the vertical one last
        self._worlds: tuple[Normalised, Normalised] | None = None
        self._search: Search | None = None

    @property
    def has_one_alignment(self) -> bool:
        """Whether the alignment is the same at all thresholds."""
        return self._alignment == "none" or self.registration == "pcr99"

    def align(self, threshold: float) -> Aligned:
        """Align for errors up to a threshold; those of lost cameras are infinite."""
        errors, estimated = np.full(len(self.gt), np.inf), self.estimated
        if np.count_nonzero(estimated) < (3 if self._alignment == "similarity" else 1):
            return Aligned(None, errors, 0)
        if self._alignment == "none":
            unit = self.normalised_gt[2]  # so that squares neither overflow nor vanish
            gt, est = self.gt[estimated] / unit, self.est[estimated] / unit
            errors[estimated] = unit * IDENTITY.position_errors(gt, est)
            return Aligned(IDENTITY, errors, 1)
        if self._worlds is None:
            self._worlds = self._normalised()
        (gt, gt_centre, gt_unit), (est, est_centre, est_unit) = self._worlds
        local, n_hypotheses = self._registered(gt, est, threshold / gt_unit)
        if local is None:
            return Aligned(None, errors, n_hypotheses)
        errors[estimated] = gt_unit * local.position_errors(gt, est)
        scale = local.scale * est_unit / gt_unit
        translation = est_centre + est_unit * local.translation - scale * local.rotation @ gt_centre
        return Aligned(Similarity(scale, local.rotation, translation), errors, n_hypotheses)

    def _normalised(self) -> tuple[Normalised, Normalised]:
        """Return the estimated cameras of both worlds; in one unit, where the scale is kept."""
        gt = self.normalised_gt if self.estimated.all() else normalise(self.gt[self.estimated])
        est, centre, unit = normalise(self.est[self.estimated])
        if self._alignment != "similarity":
            est, unit = est * (unit / gt[2]), gt[2]
        return gt, (est, centre, unit)

    def _registered(
        self, gt: Floats, est: Floats, threshold: float
    ) -> tuple[Similarity | None, int]:
        """Register normalised positions."""
        axes, back = self._axes, np.argsort(self._axes)
        settings: dict[str, Any] = {
            "n_hypotheses": self._n_hypotheses,
            "rng": np.random.default_rng(self._rng),
            "alignment": self._alignment,
        }
        if self._register is refined:
            if self._search is None:
                self._search = Search(gt[:, axes], est[:, axes], **settings)
            registered: Any = self._search.best(threshold), self._search.n_used
        else:
            rank = min(max(4, (len(self.gt) + 5) // 10), len(est))
            registered = self._register(
                gt[:, axes], est[:, axes], rank=rank, threshold=threshold, **settings
            )
        match registered:
            case (None, int() | np.integer() as n_used):
                return None, int(n_used)
            case (Similarity() as found, int() | np.integer() as n_used):
                self._check(found)
                rotation = found.rotation[np.ix_(back, back)]
                return Similarity(found.scale, rotation, found.translation[back]), int(n_used)
            case _:
                raise TypeError(
                    "registration must return a Similarity or None and the number of hypotheses, "
                    f"not {registered!r}"
                )

    def _check(self, found: Similarity) -> None:
        """Refuse what is not in the group, from a registration of one's own."""
        if self._alignment == "similarity":
            return
        turned = self._alignment == "yaw" and abs(found.rotation[2, 2] - 1) > ROUNDING
        if turned or abs(found.scale - 1) > ROUNDING:
            raise TypeError(
                f"registration must return a {self._alignment} alignment, as its argument "
                f"`alignment` says, not one of scale {found.scale:g} and rotation {found.rotation}"
            )


def _registration(registration: str | Registration) -> tuple[Registration, str]:
    """Return a registration with its name."""
    if isinstance(registration, str) and registration in REGISTRATIONS:
        return REGISTRATIONS[registration], registration
    if isinstance(registration, str) or not callable(registration):
        raise ValueError(
            f"registration must be one of {sorted(REGISTRATIONS)} or a function, "
            f"not {registration!r}"
        )
    return registration, getattr(registration, "__name__", repr(registration))


def normalise(positions: Floats) -> Normalised:
    """Return positions centred on their median and divided by their spread, with median and spread.

    Then neither a far-off origin nor squares of very large or small numbers cost any digits. Median
    and spread are robust: an outlier moves neither. The spread is about the median distance from
    the median along an axis, 1 where all positions coincide. It is a power of two, so that dividing
    by it rounds nothing.
    """
    positions = np.clip(positions, -FARTHEST_SUMMABLE, FARTHEST_SUMMABLE)
    centre = _upper_median(positions)
    with np.errstate(over="ignore"):  # beyond the largest number: infinitely far
        local = positions - centre
        distances = np.abs(local)
        moved = distances[distances > 0]
        unit = np.ldexp(1.0, np.frexp(_upper_median(moved))[1] - 1) if moved.size else 1.0
        return local / unit, centre, float(unit)


def _upper_median(values: Floats) -> Any:
    """Return the median of each column; of two middle values the upper one, not their mean."""
    half = len(values) // 2
    return np.partition(values, half, axis=0)[half]
