"""What an evaluation says about an estimate."""

import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices
from ..distance import N_THRESHOLDS
from ..histogram import AlignmentScore
from ..metrics import metric
from ..pose import PASResult
from ..profile import DEGREES, ScoreProfile, extent_units, searched_profile
from ..similarity import Similarity
from ..texts import printable
from ..trajectories.association import Matches
from ..trajectories.extras import require
from ..trajectories.files import Trajectory
from ..trajectories.parts import errors_of_parts
from ..validation import finite_rows
from .settings import Settings

__all__ = ["LOST", "STATUSES", "Evaluation", "Part", "Profiles"]

STATUSES = "matched", "no rotation", "no position", "no pose", "lost"  # of scored cameras
LOST = STATUSES.index("lost")
NO_COLUMNS = {  # of `Evaluation.to_dict`, in a table
    *("TAS_seeds", "PAS_seeds", "alignment", "parts", "body_rotation", "metrics", "notes")
}


@dataclass(frozen=True, eq=False)
class Part:
    """A part of an estimate: its name, how many cameras it counts for, and its alignment."""

    name: str
    n: int
    alignment: Similarity | None


@dataclass(frozen=True, eq=False)
class Profiles:
    """The scores of an estimate over units (of the TAS, refined registration) and degrees (RAS)."""

    units: Floats
    tas: Floats
    degrees: Floats
    ras: Floats


@dataclass(frozen=True, eq=False)
class Evaluation:
    """An estimate with its scores and all that is said about it; `evaluate` makes it.

    Parameters
    ----------
    name, file : str
        Short name, and the path as it was given; empty for a trajectory in memory.
    settings : Settings
        How it was matched and scored.
    reference : Trajectory
        The ground truth, in the order of time, without duplicates.
    estimate : Trajectory
        All poses of the estimate, with the reference's time and camera's axes.
    matches : Matches
        The poses of reference and estimate, as they were scored, camera-to-world. Those of an
        estimate in parts are in the world of the reference.
    result : PASResult
        The scores at the first seed, with errors, thresholds and alignments.
    tas_seeds : list of float
        TAS of each seed.
    half_distance, half_angle : float
        Units (in the reference's unit, and in degrees) at which TAS, by the refined registration,
        and RAS are one half; infinite where they never are.
    ate : float or None
        RMSE of the estimated camera centres after the least-squares similarity; None where there is
        none.
    metrics : mapping of str to float
        The other metrics that were asked for, by name, as far as they have a value.
    lost : float
        Share of the expected frames without a pose; with time stamps, of the time.
    chance : float
        TAS of a camera that never moves, which depends on the reference alone.
    body_rotation : (3, 3) ndarray or None
        Rotation of the camera's frame that was taken out.
    parts : list of Part
        The parts of an estimate in several ones, each aligned on its own.
    notes : list of str
        What one should know about it.
    part_positions : list of (n, 3) ndarray
        Estimated camera centres in the world of each part; not finite where it lacks the camera.
    part_of_camera : (n,) ndarray of int
        The part that counts each camera, -1 where none does.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import evaluate
    >>> from alignscores.trajectories.files import Trajectory
    >>> poses = np.tile(np.eye(4), (40, 1, 1))
    >>> poses[:, :3, 3] = np.random.default_rng(0).random((40, 3))
    >>> reference = Trajectory(np.arange(40) / 10, poses)
    >>> evaluate(reference, Trajectory(reference.keys[:20], poses[:20]))
    Evaluation(name='estimate', tas=0.75, ras=0.75, pas=0.75, lost=0.25)
    """

    name: str
    file: str
    settings: Settings
    reference: Trajectory
    estimate: Trajectory
    matches: Matches
    result: PASResult
    tas_seeds: list[float]
    half_distance: float
    half_angle: float
    ate: float | None
    metrics: Mapping[str, float]
    lost: float
    chance: float
    body_rotation: Floats | None
    parts: list[Part]
    notes: list[str]
    part_positions: list[Floats]
    part_of_camera: Indices

    def __repr__(self) -> str:
        names = "name", "tas", "ras", "pas", "lost"
        return f"Evaluation({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    @property
    def tas(self) -> float:
        """Mean of the TAS over the seeds.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum")
        >>> evaluation.tas
        0.8805
        """
        return statistics.mean(self.tas_seeds)  # exact: of equal values it is that value

    @property
    def tas_sd(self) -> float | None:
        """Standard deviation of the TAS over the seeds; None for a single one.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum", registration="pcr99", repeat=2)
        >>> evaluation.tas_sd
        0.0232
        """
        return _sd(self.tas_seeds)

    @property
    def ras(self) -> float:
        """The RAS.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum")
        >>> evaluation.ras
        0.86125
        """
        return self.result.ras.score

    @property
    def pas_seeds(self) -> list[float]:
        """PAS of each seed.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum", registration="pcr99", repeat=2)
        >>> evaluation.pas_seeds
        [0.8625, 0.8461]
        """
        weight = self.result.weight
        return [weight * tas + (1 - weight) * self.ras for tas in self.tas_seeds]

    @property
    def pas(self) -> float:
        """Mean of the PAS over the seeds.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum")
        >>> evaluation.pas
        0.8709
        """
        return statistics.mean(self.pas_seeds)

    @property
    def pas_sd(self) -> float | None:
        """Standard deviation of the PAS over the seeds; None for a single one.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum", registration="pcr99", repeat=2)
        >>> evaluation.pas_sd
        0.0116
        """
        return _sd(self.pas_seeds)

    @property
    def scale(self) -> float | None:
        """How large the estimate is, relative to the reference; None where it is not aligned.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum")
        >>> evaluation.scale
        0.702
        """
        alignment = self.result.tas.alignment
        return None if alignment is None or self.parts else alignment.scale

    @property
    def positions(self) -> Floats:
        """Estimated camera centres, (n, 3), in the reference's world; NaN where there are none.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum")
        >>> evaluation.positions.shape
        (40, 3)
        """
        positions = self.matches.est_poses[:, :3, 3]
        if self.result.tas.alignment is None:
            return np.full_like(positions, np.nan)
        return self.result.tas.alignment.inverse().apply(positions)

    @property
    def statuses(self) -> NDArray[np.uint8]:
        """Whether each camera was matched, or why it is a failure: index into `STATUSES`.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum")
        >>> evaluation.statuses[6:12]
        array([0, 0, 0, 0, 0, 0], dtype=uint8)
        """
        poses = self.matches.est_poses
        no_position, no_rotation = ~finite_rows(poses[:, :3, 3]), ~finite_rows(poses[:, :3, :3])
        codes = np.where(self.matches.est_rows < 0, LOST, 2 * no_position + no_rotation)
        return codes.astype(np.uint8)

    @cached_property
    def profiles(self) -> Profiles:
        """The scores over all units, which are the same for all estimates of a reference.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum")
        >>> evaluation.profiles.units.shape, evaluation.profiles.tas.shape
        ((64,), (64,))
        """
        try:
            units = extent_units(self.reference.poses[self.matches.expected_rows, :3, 3])
        except ValueError:  # all cameras in one place, so that --unit alone has a size
            units = self.result.tas.unit * np.geomspace(1 / 16, 4, 7)
        ras = rotation_profile(self.result.ras).scores
        gt, parts = self.matches.gt_poses[:, :3, 3], self.part_positions
        errors_at = errors_of_parts(
            *(gt, parts, self.part_of_camera),
            rng=self.settings.seed,
            alignment=self.settings.alignment,
            up=self.settings.up,
        )
        tas = searched_profile(errors_at, units, N_THRESHOLDS).scores
        return Profiles(units, tas, DEGREES, ras)

    def value(self, name: str) -> float | None:
        """Return a score, or one of the metrics that were asked for; None where it has no value.

        Parameters
        ----------
        name : str
            Such as "TAS", "half_distance", "ATE" or "auc@30:vggt".

        Returns
        -------
        float or None
            The value, in the unit of the metric.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum")
        >>> evaluation.value("half_distance")
        0.0700
        """
        scores = {
            "TAS": self.tas,
            "RAS": self.ras,
            "PAS": self.pas,
            "half_distance": self.half_distance,
            "half_angle": self.half_angle,
            "ATE": self.ate,
        }
        known = metric(name).name
        return finite_or_none(scores[known] if known in scores else self.metrics.get(known))

    def to_dict(self) -> dict[str, Any]:
        """Return what the command prints for it with ``--json``.

        Returns
        -------
        dict
            Without NaN and infinite numbers, which are None. The keys are described in
            ``docs/reference/results.md``.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum")
        >>> evaluation.to_dict()["n"]
        40
        """
        tas, ras, matches = self.result.tas, self.result.ras, self.matches
        return {
            "name": self.name,
            "file": printable(self.file),
            "TAS": self.tas,
            "TAS_sd": self.tas_sd,
            "RAS": self.ras,
            "PAS": self.pas,
            "PAS_sd": self.pas_sd,
            "TAS_seeds": self.tas_seeds,
            "PAS_seeds": self.pas_seeds,
            "half_distance": finite_or_none(self.half_distance),
            "half_angle": finite_or_none(self.half_angle),
            "ATE": self.ate,
            "n": len(tas.errors),
            "lost": self.lost,
            "chance": self.chance,
            "matched": matches.matched,
            "missing": matches.missing,
            "non_finite": matches.non_finite,
            "no_position": int(np.sum(~finite_rows(matches.est_poses[:, :3, 3]))),
            "no_rotation": int(np.sum(~finite_rows(matches.est_poses[:, :3, :3]))),
            "duplicate": matches.duplicate,
            "unmatched": matches.unmatched,
            "unit": tas.unit,
            "within_unit": float(np.mean(tas.errors < tas.unit)),
            "within_10_deg": float(np.mean(ras.errors < 10.0)),
            "n_hypotheses": tas.n_hypotheses,
            "scale": self.scale,
            "alignment": None if self.parts else _alignment(tas.alignment),
            "parts": [
                {"name": part.name, "n": part.n, "alignment": _alignment(part.alignment)}
                for part in self.parts
            ],
            "body_rotation": None if self.body_rotation is None else self.body_rotation.tolist(),
            "metrics": {name: self.value(name) for name in self.settings.metrics},
            "notes": self.notes,
        }

    def to_frame(self) -> Any:
        """Return the numbers as a table of pandas with a single row.

        Returns
        -------
        pandas.DataFrame
            What `to_dict` has of names and numbers; the metrics are columns, too.

        Raises
        ------
        ModuleNotFoundError
            Where pandas is not installed.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> files = "tests/data/tum/reference.txt", "tests/data/tum/estimate.txt"
        >>> evaluation = evaluate(*files, format="tum")
        >>> evaluation.to_frame().shape[0]
        1
        """
        values = self.to_dict()
        row = {key: value for key, value in values.items() if key not in NO_COLUMNS}
        return require("pandas", "tables").DataFrame([{**row, **values["metrics"]}])


def rotation_profile(ras: AlignmentScore) -> ScoreProfile:
    """Return the profile of the RAS."""
    return ScoreProfile(DEGREES, [np.sort(ras.errors)], len(ras.thresholds))


def finite_or_none(value: float | None) -> float | None:
    """Return a number, None where it is infinite or NaN, which JSON has not."""
    return value if value is not None and math.isfinite(value) else None


def _sd(values: list[float]) -> float | None:
    return statistics.stdev(values) if len(values) > 1 else None


def _alignment(alignment: Similarity | None) -> dict[str, Any] | None:
    """Return what takes the estimate to the reference: x -> scale * rotation @ x + translation."""
    if alignment is None:
        return None
    found = alignment.inverse()
    if not np.isfinite([found.scale, *found.translation]).all():
        return None
    return {
        "scale": found.scale,
        "rotation": found.rotation.tolist(),
        "translation": found.translation.tolist(),
    }
