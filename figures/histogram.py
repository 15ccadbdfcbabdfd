"""Figure 1: the errors of one trial under the settings of the experiment ``combined``."""

from matplotlib.figure import Figure

from alignscores import pas
from alignscores.show.plots import score_panel
from experiments.config import Sweep
from experiments.grid import Cell
from experiments.sweep import draw_scene, trial_seeds

from . import style

CELL = Cell(n_cameras=100, n_outliers=10, sigma_t=0.03, sigma_r_deg=3.0)
TRIAL = 0


def histogram(sweep: Sweep) -> Figure:
    """Figure 1: cumulative frequency histograms of one trial, whose areas are TAS and RAS."""
    camera_seed, registration_seed = trial_seeds(sweep, CELL, TRIAL)
    scene = draw_scene(sweep, CELL, camera_seed)
    scores = pas(scene.gt_poses, scene.est_poses, rng=registration_seed)
    unit = scores.tas.unit
    figure = Figure(figsize=(style.COLUMN, 3.1), layout="constrained")
    top, bottom = figure.subplots(2)
    top.set_xlabel(f"threshold in units of d (d = {unit:.3f})")
    bottom.set_xlabel("threshold in degrees")
    for axes, errors, name, result, scale in (
        (top, "position errors", "TAS", scores.tas, unit),
        (bottom, "rotation errors", "RAS", scores.ras, 1.0),
    ):
        thresholds, frequency = result.thresholds / scale, result.cumulative_frequency
        score_panel(axes, thresholds, frequency, len(result.errors), name=name, score=result.score)
        axes.set_title(f"Number of cameras with {errors} below the threshold", fontsize=style.TEXT)
    return figure
