"""The result of an evaluation: one estimate with its scores."""

import math
import statistics
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..extras import require
from ..io import Trajectory
from ..metrics import header, metric
from ..pose import PASResult
from ..similarity import Similarity
from ..texts import printable
from ..thresholds import N_THRESHOLDS, smallest_unit
from ..validation import finite_rows
from .deficits import Deficit, deficits
from .lever import LeverArm
from .match import Matches
from .perfect import simulated_scores
from .settings import Settings

__all__ = ["FAILED", "LOST", "STATUSES", "Evaluation", "Model", "Note", "finite_or_none", "median"]

STATUSES = "matched", "no rotation", "no position", "lost"  # of scored cameras
LOST = STATUSES.index("lost")
FAILED = "failed"  # kind of the note on an estimate without any pose that counts
SAMPLE = 1000  # frames from which the chance level is computed
NO_COLUMNS = {
    *("TAS_seeds", "perfect", "deficits", "alignment", "body_rotation", "lever_arm"),
    *("metrics", "notes", "models"),
}


@dataclass(frozen=True)
class Note:
    """A note on an estimate: a kind for programs, a sentence, and what to do, if anything."""

    kind: str
    text: str
    remedy: str = ""

    def __str__(self) -> str:
        return f"{self.text}; {self.remedy}" if self.remedy else self.text

    def named(self, name: str) -> str:
        """Return the note after the name of its estimate, unless it names the file itself."""
        return str(self) if self.kind == "file" else f"{name}: {self}"


class Hint(Note):
    """A note on what looks like a mistake in a file; `alignscores compare` checks first runs."""


@dataclass(frozen=True)
class Model:
    """A model of an estimate of several: its size, and its scores with all other images missing.

    Scores are None where too few of its images are in the reference.
    """

    name: str
    images: int
    coverage: float
    TAS: float | None = None
    RAS: float | None = None
    PAS: float | None = None


@dataclass(frozen=True, eq=False)
class Evaluation:
    """An estimate with its scores, as `evaluate` returns it.

    Parameters
    ----------
    name, file : str
        Short name, and the path as it was given; empty for a trajectory in memory.
    settings : Settings
        How it was matched and scored.
    reference : Trajectory
        The ground truth, in the order of time, without duplicates.
    estimate : Trajectory
        All poses of the estimate, with the clock and the camera axes of the reference.
    read : Trajectory
        The poses of the estimate as its file has them, camera-to-world, on their own clock.
    matches : Matches
        The poses of reference and estimate as they were scored.
    result : PASResult
        The scores at the first seed, with errors, thresholds and alignments.
    tas_seeds : list of float
        TAS of each seed.
    half_distance : float
        d at which the TAS, by the refined registration, is one half; infinite where it never is.
    ate : float or None
        RMSE of the estimated camera centres after the least-squares alignment.
    metrics : mapping of str to float
        The other metrics that were asked for, by name, as far as they have a value.
    t_offset : float
        Seconds added to the time stamps of the estimate.
    body_rotation : (3, 3) ndarray or None
        Rotation of the camera frame that was removed.
    lever_arm : LeverArm or None
        Position in the estimate's body frame that is compared with the reference's, if another one
        than the origin.
    notes : list of Note
        What may be wrong with the estimate or with the settings.
    models : tuple of Model
        The models of an estimate of several, the best one first, which has these scores.

    Examples
    --------
    >>> import numpy as np
    >>> from alignscores import Trajectory, evaluate
    >>> poses = np.tile(np.eye(4), (40, 1, 1))
    >>> poses[:, :3, 3] = np.random.default_rng(0).random((40, 3))
    >>> reference = Trajectory(np.arange(40) / 10, poses)
    >>> evaluation = evaluate(reference, Trajectory(reference.keys[:20], poses[:20]))
    >>> evaluation
    Evaluation('estimate', PAS 0.750, TAS 0.750, RAS 0.750, registration='refined')
    >>> evaluation.lost, evaluation.median_distance < 1e-6
    (0.25, True)
    """

    name: str
    file: str
    settings: Settings
    reference: Trajectory
    estimate: Trajectory
    read: Trajectory
    matches: Matches
    result: PASResult
    tas_seeds: list[float]
    half_distance: float
    ate: float | None
    metrics: Mapping[str, float]
    t_offset: float
    body_rotation: Floats | None
    lever_arm: LeverArm | None
    notes: list[Note]
    models: tuple[Model, ...] = ()

    def __repr__(self) -> str:
        scores = f"PAS {self.pas:.3f}, TAS {self.tas:.3f}, RAS {self.ras:.3f}"
        return f"Evaluation({self.name!r}, {scores}, registration={self.settings.registration!r})"

    def _repr_html_(self) -> str:
        unit, values = self.settings.file_format.unit, {**self.scores, "lost": self.lost}
        cells = "".join(
            f"<tr><th>{name if name == 'lost' else header(name, unit)}</th>"
            f"<td>{'-' if value is None else format(value, '.3g')}</td></tr>"
            for name, value in values.items()
        )
        caption = escape(f"{self.name}; {self.settings.how_aligned}")
        return f"<table><caption>{caption}</caption>{cells}</table>"

    @property
    def tas(self) -> float:
        """Mean of the TAS over the seeds."""
        return statistics.mean(self.tas_seeds)  # exact: the mean of equal values is that value

    @property
    def has_rotations(self) -> bool:
        """Whether both have rotations; otherwise RAS and PAS are NaN."""
        return self.matches.has_rotations

    @property
    def ras(self) -> float:
        """The RAS."""
        return self.result.ras.score

    @property
    def pas(self) -> float:
        """Mean of the PAS over the seeds."""
        return self.result.weight * self.tas + (1 - self.result.weight) * self.ras

    @cached_property
    def half_angle(self) -> float:
        """Degrees at which the RAS is one half; infinite where it never is."""
        ras = self.result.ras
        errors = np.nan_to_num(np.sort(ras.errors), nan=np.inf)  # NaN: without rotations
        return smallest_unit(errors, 0.5, len(ras.thresholds))

    @property
    def median_distance(self) -> float:
        """Median position error of the frames that have one; NaN where none has."""
        return median(self.result.tas.errors)

    @property
    def median_angle(self) -> float:
        """Median rotation error in degrees of the frames that have one; NaN where none has."""
        return median(self.result.ras.errors)

    @property
    def lost(self) -> float:
        """Share of the expected frames without a finite pose; with time stamps, of the time."""
        matches = self.matches
        return 1 - float(np.sum(finite_rows(matches.est_poses))) / len(matches.expected_rows)

    @cached_property
    def chance(self) -> float:
        """Chance level: the highest TAS of a camera that never moves."""
        positions = self.reference.poses[self.matches.expected_rows, :3, 3]
        n = len(positions)
        sample = positions[np.linspace(0, n - 1, min(SAMPLE, n)).astype(int)]
        largest = self.result.tas.unit * self.settings.max_threshold
        squared = sum((axis[:, None] - axis) ** 2 for axis in sample.T)
        below = N_THRESHOLDS - np.floor(np.sqrt(squared) * (N_THRESHOLDS / largest))
        return float(np.maximum(below, 0).mean(axis=1).max() / N_THRESHOLDS)

    @cached_property
    def perfect(self) -> dict[str, list[float]] | None:
        """Scores of a perfect estimate under a reference with the errors of `reference_sigma`.

        The mean and the lowest of 19 simulations, of TAS, RAS and PAS: a perfect estimate would
        be below the lowest in one of 20 cases. None without `reference_sigma`.
        """
        settings, matches = self.settings, self.matches
        if settings.reference_sigma is None:
            return None
        poses = self.reference.poses[matches.expected_rows]
        scores = simulated_scores(poses, self.result.tas.unit, settings)
        return scores if self.has_rotations else {"TAS": scores["TAS"]}

    @cached_property
    def deficits(self) -> list[Deficit]:
        """Where the TAS and the RAS are lost: their costliest stretches, and the rest.

        All costs of a score add up to what it lacks to 1, the TAS at the first seed.
        """
        matches, result, stretches = self.matches, self.result, []
        keys = matches.keys
        if matches.timed:
            keys = np.round(keys - self.reference.keys[0], 6)
        positions, rotations = matches.est_poses[:, :3, 3], matches.est_poses[:, :3, :3]
        for name, score, poses in (("TAS", result.tas, positions), ("RAS", result.ras, rotations)):
            if name == "TAS" or self.has_rotations:
                lost = ~finite_rows(poses)
                stretches += deficits(name, score.errors, score.thresholds, lost, keys)
        return stretches

    @property
    def scores(self) -> dict[str, float | None]:
        """The scores by their names in JSON; None where one has no value."""
        values = {
            "TAS": self.tas,
            "RAS": self.ras,
            "PAS": self.pas,
            "half_distance": self.half_distance,
            "half_angle": self.half_angle,
            "ate": self.ate,
        }
        return {name: finite_or_none(value) for name, value in values.items()}

    @property
    def scale(self) -> float | None:
        """Size of the estimate relative to the reference; None where it is not aligned."""
        alignment = self.result.tas.alignment
        return None if alignment is None else alignment.scale

    @property
    def positions(self) -> Floats:
        """Estimated camera centres, (n, 3), in the reference frame; NaN where there are none."""
        positions = self.matches.est_poses[:, :3, 3]
        if self.result.tas.alignment is None:
            return np.full_like(positions, np.nan)
        return self.result.tas.alignment.inverse().apply(positions)

    @property
    def statuses(self) -> NDArray[np.uint8]:
        """Whether each camera was matched, or why it is a failure: index into `STATUSES`."""
        poses = self.matches.est_poses
        no_position, no_rotation = ~finite_rows(poses[:, :3, 3]), ~finite_rows(poses[:, :3, :3])
        codes = np.where(no_position & no_rotation, LOST, 2 * no_position + no_rotation)
        return codes.astype(np.uint8)

    def value(self, name: str) -> float | None:
        """Return a score, or one of the metrics in the settings; None where it has no value.

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
        >>> evaluation = evaluate("tests/data/tum/reference.txt", "tests/data/tum/estimate.txt")
        >>> evaluation.value("half_distance")
        0.0700
        """
        values = {**self.scores, "ATE": self.ate, **self.metrics}
        return values.get(name if name in values else metric(name).name)

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
        >>> evaluation = evaluate("tests/data/tum/reference.txt", "tests/data/tum/estimate.txt")
        >>> evaluation.to_dict()["n"]
        40
        """
        tas, ras, matches = self.result.tas, self.result.ras, self.matches
        return {
            "name": self.name,
            "file": printable(self.file),
            **self.scores,
            "TAS_seeds": self.tas_seeds,
            "median_distance": finite_or_none(self.median_distance),
            "median_angle": finite_or_none(self.median_angle),
            "unit": tas.unit,
            "within_unit": float(np.mean(tas.errors < tas.unit)),
            "within_10_deg": float(np.mean(ras.errors < 10.0)) if self.has_rotations else None,
            "n": len(tas.errors),
            "lost": self.lost,
            "chance": self.chance,
            "perfect": self.perfect,
            "deficits": [asdict(deficit) for deficit in self.deficits],
            "expected": len(matches.expected_rows),
            "matched": matches.matched,
            "no_position": int(np.sum(~finite_rows(matches.est_poses[:, :3, 3]))),
            "no_rotation": int(np.sum(~finite_rows(matches.est_poses[:, :3, :3]))),
            "duplicate": matches.duplicate,
            "unmatched": matches.unmatched,
            "n_hypotheses": tas.n_hypotheses,
            "scale": self.scale,
            "alignment": _alignment(tas.alignment),
            "t_offset": self.t_offset if matches.timed else None,
            "body_rotation": None if self.body_rotation is None else self.body_rotation.tolist(),
            "lever_arm": None if self.lever_arm is None else self.lever_arm.vector.tolist(),
            "metrics": {name: self.value(name) for name in (*self.settings.metrics, *self.metrics)},
            "models": [asdict(model) for model in self.models],
            "notes": [asdict(note) for note in self.notes],
        }

    def to_frame(self) -> Any:
        """Return the numbers as a table of pandas with a single row.

        Returns
        -------
        pandas.DataFrame
            Names and numbers of `to_dict`, and a column for each metric.

        Raises
        ------
        ModuleNotFoundError
            Where pandas is not installed.

        Examples
        --------
        >>> from alignscores import evaluate
        >>> evaluation = evaluate("tests/data/tum/reference.txt", "tests/data/tum/estimate.txt")
        >>> evaluation.to_frame().shape[0]
        1
        """
        values = self.to_dict()
        row = {key: value for key, value in values.items() if key not in NO_COLUMNS}
        return require("pandas", "tables").DataFrame([{**row, **values["metrics"]}])


def finite_or_none(value: float | None) -> float | None:
    """Return a number, None where it is infinite or NaN, which JSON has not."""
    return value if value is not None and math.isfinite(value) else None


def median(errors: Floats) -> float:
    """Return the median of the finite errors, NaN where there are none."""
    finite = errors[np.isfinite(errors)]
    return float(np.median(finite)) if len(finite) else math.nan


def _alignment(alignment: Similarity | None) -> dict[str, Any] | None:
    """Return the similarity from the reference to the estimate, s R x + t."""
    if alignment is None or not np.isfinite([alignment.scale, *alignment.translation]).all():
        return None
    return {
        "scale": alignment.scale,
        "rotation": alignment.rotation.tolist(),
        "translation": alignment.translation.tolist(),
    }
