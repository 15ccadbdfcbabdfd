"""What is measured: the metrics on a scene, another registration, the floor."""

import importlib.util
from collections.abc import Callable
from ctypes import CDLL
from functools import partial
from unittest.mock import patch

import numpy as np

from alignscores import pas, ras, tas, tas_profile
from alignscores.protocols import NoValueError, protocol
from alignscores.registration import kernel
from baselines import ate, dte, maa
from experiments.scenes import Scene, make_scene

from .floor import counter

__all__ = [
    "METRICS",
    "PROFILE",
    "REFINED",
    "UNCOMPILED",
    "contenders",
    "protocol_value",
    "scene",
]

N_HYPOTHESES = 1000
SIGMA_T = 0.03
UNCOMPILED = "TAS, NumPy"
REFINED = "TAS, refined"
PROFILE = "profile"

METRICS: dict[str, Callable[[Scene], object]] = {
    "TAS": lambda s: tas(s.gt_positions, s.est_positions, n_hypotheses=N_HYPOTHESES),
    "RAS": lambda s: ras(s.gt_rotations, s.est_rotations),
    "PAS": lambda s: pas(s.gt_poses, s.est_poses, n_hypotheses=N_HYPOTHESES),
    "mAA": lambda s: maa(s.gt_poses, s.est_poses),
    "DTE": lambda s: dte(s.gt_poses, s.est_poses),
    "ATE": lambda s: ate(s.gt_positions, s.est_positions),
}


def scene(n_cameras: int, outliers: float) -> Scene:
    """Cameras at the density of the study's length experiment; a share of them are outliers."""
    return make_scene(
        np.random.default_rng(n_cameras),
        geometry="cube",
        volume=0.1 * n_cameras,
        n_cameras=n_cameras,
        n_outliers=round(outliers * n_cameras),
        sigma_t=SIGMA_T,
        sigma_r_deg=3.0,
    )


def protocol_value(name: str, cameras: Scene) -> float:
    """Evaluate a protocol on a scene; NaN where it has no value."""
    try:
        return protocol(name)(*cameras.arrays)
    except NoValueError:
        return np.nan


def contenders(
    n_cameras: int, outliers: float, floor: CDLL | None
) -> dict[str, Callable[[], object]]:
    """Return what is measured on a scene by its name: metrics, and what they are compared with."""
    cameras = scene(n_cameras, outliers)
    calls: dict[str, Callable[[], object]] = {
        name: partial(metric, cameras) for name, metric in METRICS.items()
    }
    gt, est = cameras.gt_positions, cameras.est_positions
    calls[REFINED] = partial(tas, gt, est, n_hypotheses=N_HYPOTHESES, registration="refined")
    calls[PROFILE] = partial(tas_profile, gt, est, n_hypotheses=N_HYPOTHESES)
    if kernel.LIBRARY is not None:
        calls[UNCOMPILED] = patch.object(kernel, "LIBRARY", None)(calls["TAS"])
    alignment = tas(gt, est).alignment
    assert alignment is not None
    reach = 3 * SIGMA_T * alignment.scale
    if importlib.util.find_spec("pycolmap"):
        import pycolmap

        options = pycolmap.RANSACOptions(
            max_error=reach, min_num_trials=N_HYPOTHESES, max_num_trials=N_HYPOTHESES
        )
        calls["pycolmap"] = lambda: pycolmap.estimate_sim3d_robust(gt, est, options)
    if floor is not None:
        rows = np.column_stack([alignment.scale * alignment.rotation, alignment.translation])
        calls["floor"] = counter(floor, np.tile(rows, (N_HYPOTHESES, 1, 1)), gt, est, reach**2)
    return calls
