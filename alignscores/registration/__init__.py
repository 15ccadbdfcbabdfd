"""Robust registration of camera positions (section 3, step 2): the paper's and a refined one.

`REGISTRATIONS` are those that `tas` has by name, written in C in the folder ``kernel`` and defined
in ``docs/explanation/registration.md``. Any function of the signature of `Registration` is another.
"""

from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from ..arrays import Floats, Indices
from ..similarity import FARTHEST_SQUARABLE, Similarity, check_alignment
from ..validation import check_position_pair, check_positive, finite_rows
from . import kernel

__all__ = ["REGISTRATIONS", "Registration", "Search", "Seed", "pcr99"]

Seed = int | np.random.SeedSequence | np.random.Generator | None

REGISTRATIONS = "pcr99", "refined"
PRESCREEN = 0.1  # largest difference between the log edge ratios of a triplet (PCR-99)
N_CAMERAS_NEEDED = {"similarity": 3, "rigid": 1, "yaw": 1, "none": 1}
ROUNDING = 1e-6  # by which the scale of a user-supplied rigid alignment may differ from 1


class Registration(Protocol):
    """What `tas` calls to align the estimate: any function of this signature.

    It is given the cameras that were estimated, each frame centred on its median and scaled by its
    spread, and the settings, which it may ignore. It returns the alignment, from ground
    truth to estimate (None where there is none), and the number of hypotheses it was chosen from.
    """

    def __call__(
        self,
        gt_positions: Floats,
        est_positions: Floats,
        /,
        *,
        rank: int,
        threshold: float,
        n_hypotheses: int,
        rng: np.random.Generator,
        alignment: str,
    ) -> tuple[Similarity | None, int]:
        """Register ``(n, 3)`` estimated positions to the ground truth.

        ``rank`` is m of the paper, at most n; ``threshold`` is the largest error threshold in the
        given ground-truth units. ``alignment`` is "similarity", "rigid" or "yaw", whose vertical
        axis is the third one.
        """
        ...


class Search:
    """The search for the alignment of checked positions (n, 3), at one or several thresholds.

    The arguments are those of `tas`; ``rank`` is m, by default the paper's. The estimated cameras
    are registered in normalised frames, centred on their medians and in units of powers of two near
    their spreads: neither a far origin nor very large or small numbers cost digits. At several
    thresholds the refined registration draws its hypotheses once, and each alignment is a start at
    the next.
    """

    def __init__(
        self,
        gt: Floats,
        est: Floats,
        registration: str | Registration,
        *,
        rng: Seed,
        n_hypotheses: int,
        alignment: str,
        up: str,
        at_several: bool = False,
        rank: int | None = None,
        prescreen: float = PRESCREEN,
    ) -> None:
        check_positive(n_hypotheses, "n_hypotheses", integer=True)
        check_alignment(alignment, up)
        self.name = _name(registration)
        self.alignment = alignment
        self._registration, self._n_hypotheses = registration, int(n_hypotheses)
        self._rng, self._generator = rng, _generator(rng)
        self._at_several, self._prescreen = at_several, prescreen
        # m of the paper, the rank of the error that is the cost; halves are rounded up.
        self._m = max(4, (len(gt) + 5) // 10) if rank is None else int(rank)
        self._n, self._estimated = len(gt), None if np.isfinite(est).all() else finite_rows(est)
        if self._estimated is not None:
            gt, est = gt[self._estimated], est[self._estimated]
        # Under "yaw" the vertical axis becomes the third one.
        self._axes = np.roll(np.arange(3), -1 - "xyz".index(up[-1])) if alignment == "yaw" else None
        if self._axes is not None:
            gt, est = gt[:, self._axes], est[:, self._axes]
        self._gt, self._gt_frame = kernel.normalise(np.ascontiguousarray(gt))
        unit = np.nan if alignment == "similarity" else self._gt_frame[3]
        if alignment != "none":
            self._est, self._est_frame = kernel.normalise(np.ascontiguousarray(est), unit)
        else:
            self._est_frame = self._gt_frame
            with np.errstate(over="ignore"):  # infinitely far
                self._gt, self._est = (np.ascontiguousarray(p.T) / unit for p in (gt, est))
            self._gt_frame[:3] = 0.0
        self._hypotheses: Floats | None = None  # of the refined registration
        self._best = np.full(13, np.nan)

    @property
    def has_one_alignment(self) -> bool:
        """Whether the alignment is the same at all thresholds."""
        return self.alignment == "none" or self.name == "pcr99"

    def register(self, threshold: float) -> tuple[Floats | None, int]:
        """Return the best alignment, or None, and the number of hypotheses.

        The alignment is a row of scale, rotation and translation in normalised frames; the largest
        error threshold is in ground-truth units.
        """
        n = self._gt.shape[1]
        if n < N_CAMERAS_NEEDED[self.alignment]:
            return None, 0
        if self.alignment == "none":
            return _row(Similarity(1.0, np.eye(3), np.zeros(3))), 1
        rank, threshold = min(self._m, n), threshold / self._gt_frame[3]
        if callable(self._registration):
            registered: Any = self._registration(
                np.ascontiguousarray(self._gt.T),
                np.ascontiguousarray(self._est.T),
                rank=rank,
                threshold=threshold,
                n_hypotheses=self._n_hypotheses,
                rng=np.random.default_rng(self._rng),
                alignment=self.alignment,
            )
            similarity, n_used = _checked(registered, self.alignment)
            return None if similarity is None else _row(similarity), n_used
        if self._registration == "pcr99":
            row, n_used = kernel.pcr99(
                self._gt,
                self._est,
                self.alignment,
                rank=rank,
                n_hypotheses=self._n_hypotheses,
                prescreen=self._prescreen,
                rng=self._generator,
            )
            return None if np.isnan(row[0]) else row, n_used
        return self._refine(threshold)

    def errors(self, row: Floats | None) -> Floats:
        """Return the errors (n,) under an alignment that was found, in ground-truth units.

        They are infinite where a camera was not estimated, or without an alignment.
        """
        if row is None:
            return np.full(self._n, np.inf)
        values = kernel.errors(self._gt, self._est, row, unit=self._gt_frame[3])
        if self._estimated is None:
            return values
        errors = np.full(self._n, np.inf)
        errors[self._estimated] = values
        return errors

    def similarity(self, row: Floats | None) -> Similarity | None:
        """Return an alignment that was found as that of the positions themselves."""
        if row is None:
            return None
        R, t = row[1:10].reshape(3, 3), row[10:]
        gt_frame, est_frame = self._gt_frame, self._est_frame
        if self._axes is not None:
            back = np.argsort(self._axes)
            R, t = R[back][:, back], t[back]
            gt_frame, est_frame = gt_frame[[*back, 3]], est_frame[[*back, 3]]
        # In Python's numbers, which are the faster ones here and overflow without a warning.
        (x, y, z, gt_unit), (*est_centre, est_unit) = gt_frame.tolist(), est_frame.tolist()
        s = float(row[0]) * est_unit / gt_unit
        origin = [s * u * x + s * v * y + s * w * z for u, v, w in R.tolist()]
        moved = zip(est_centre, t.tolist(), origin, strict=True)
        translation = np.array([centre + est_unit * k - start for centre, k, start in moved])
        return Similarity(s, R, translation)

    def _refine(self, threshold: float) -> tuple[Floats | None, int]:
        is_first = self._hypotheses is None
        if self._hypotheses is None:
            self._hypotheses = kernel.refined_hypotheses(
                self._gt,
                self._est,
                self.alignment,
                n_hypotheses=self._n_hypotheses,
                rng=self._generator,
            )
            # In random order, so that the first cameras are a sample; far outliers can be squared.
            order, far = _random_order(self._gt.shape[1]), FARTHEST_SQUARABLE
            self._shuffled_gt, self._shuffled_est = (
                points.take(order, axis=1) for points in (self._gt, self._est)
            )
            for points in (self._shuffled_gt, self._shuffled_est):  # faster than clip
                np.minimum(np.maximum(points, -far, out=points), far, out=points)
        kernel.refine(
            self._shuffled_gt,
            self._shuffled_est,
            self.alignment,
            self._hypotheses,
            threshold=threshold,
            best=self._best,
            is_first_of_several=self._at_several and is_first,
        )
        row = None if np.isnan(self._best[0]) else self._best.copy()
        return row, len(self._hypotheses)


def pcr99(
    gt_positions: Floats,
    est_positions: Floats,
    /,
    *,
    rank: int,
    threshold: float = 1.0,
    n_hypotheses: int,
    rng: np.random.Generator,
    alignment: str = "similarity",
    prescreen: float = PRESCREEN,
) -> tuple[Similarity | None, int]:
    """Register by PCR-99 with unknown scale, as the paper does; see `Registration`.

    ``threshold`` is not used; ``prescreen`` is the largest difference between the log edge ratios
    of a triplet. Where no more than ``n_hypotheses`` triplets exist all are tried, each with its
    three first edges, and nothing is random. O(n_hypotheses * n) time, O(n) memory.
    """
    check_positive(rank, "rank", integer=True)
    gt, est = check_position_pair(gt_positions, est_positions)
    search = Search(
        gt,
        est,
        "pcr99",
        rng=rng,
        n_hypotheses=n_hypotheses,
        alignment=alignment,
        up="z",
        rank=rank,
        prescreen=prescreen,
    )
    row, n_used = search.register(threshold)
    return search.similarity(row), n_used


def _name(registration: str | Registration) -> str:
    """Return the name of a registration."""
    if callable(registration):
        return getattr(registration, "__name__", repr(registration))
    if registration not in REGISTRATIONS:
        choices = f"one of {sorted(REGISTRATIONS)} or a function"
        raise ValueError(f"registration must be {choices}, not {registration!r}")
    return registration


def _generator(rng: Seed) -> np.random.Generator:
    """Return the Generator itself, or one of a seed."""
    try:
        return np.random.default_rng(rng)
    except (TypeError, ValueError) as error:
        raise ValueError(f"rng must be a seed or a Generator, not {rng!r}: {error}") from None


@lru_cache(maxsize=4)
def _random_order(n: int) -> Indices:
    """Return the order in which the refined registration goes through n cameras."""
    return np.random.default_rng(0).permutation(n)


def _row(similarity: Similarity) -> Floats:
    """Return an alignment as the kernel has it."""
    return np.array([similarity.scale, *similarity.rotation.flat, *similarity.translation])


def _checked(registered: Any, alignment: str) -> tuple[Similarity | None, int]:
    """Return the result of a user-supplied registration, or raise TypeError."""
    match registered:
        case (None | Similarity() as similarity, int() | np.integer() as n_used):
            pass
        case _:
            raise TypeError(
                "registration must return a Similarity or None and the number of hypotheses, "
                f"not {registered!r}"
            )
    if similarity is not None and alignment != "similarity":
        turned = alignment == "yaw" and abs(similarity.rotation[2, 2] - 1) > ROUNDING
        if turned or abs(similarity.scale - 1) > ROUNDING:
            raise TypeError(
                f"registration must return a {alignment} alignment, as its argument `alignment` "
                f"says, not one of scale {similarity.scale:g} and rotation {similarity.rotation}"
            )
    return similarity, int(n_used)
