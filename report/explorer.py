"""The page to play with: ``python -m report.explorer CAMERA_ERRORS.npz --output FILE.html``."""

import sys
from argparse import ArgumentParser, Namespace
from base64 import b64encode
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_hex

from alignscores.arrays import Floats
from alignscores.explorer import source
from alignscores.explorer.document import document
from experiments.camera_errors import CameraErrors, read_camera_errors
from experiments.command import CommandError, run_command
from experiments.config import Sweep
from experiments.grid import CELL_SETTINGS, cells
from experiments.metrics import PASOptions, RASOptions, TASOptions, order_statistic
from experiments.tables import write_files
from figures.curves import write_value
from figures.style import colours

from .page import environment, own

TITLES = {  # of the paper's experiments: its figure, and a name
    "outliers": ("Figure 2", "Outliers"),
    "collinear": ("Figure 3", "Collinear"),
    "trajectory_length": ("Figure 4", "Number of cameras"),
    "rotations": ("Figure 5", "Rotations"),
    "combined": ("Figure 6", "Both noises"),
    "maa_vs_pas_outliers": ("Figure 7a", "Poses, outliers"),
    "maa_vs_pas_length": ("Figure 7b", "Poses, cameras"),
    "maa_vs_pas_collinear": ("Figure 7c", "Poses, collinear"),
}
NAMES = {"n_cameras": "cameras", "n_outliers": "outliers", "sigma_t": "σₜ", "sigma_r_deg": "σᵣ"}
WORSE = {"n_outliers": "outliers", "sigma_r_deg": "rotation noise"}  # the more of it
SCRIPTS = "scores.js", "charts.js", "controls.js"
QUANTILES = [k / 20 for k in range(1, 21)]  # of the closest-pair distances, that d can be
FAILURE = 2**16 - 1  # its code; 0 is that of no error at all


def render(experiments: Sequence[CameraErrors]) -> str:
    """Write the page, which needs no other file and has no date."""
    paper = {
        "tas": TASOptions().max_threshold,
        "ras": RASOptions().max_threshold_deg,
        "quantile": TASOptions().quantile,
        "thresholds": TASOptions().n_thresholds,
        "weight": PASOptions().weight,
    }
    ordered = sorted(experiments, key=lambda one: [*TITLES, one.sweep.name].index(one.sweep.name))
    shown = [_experiment(one) for one in ordered]
    template = environment().get_template("explorer.html.j2")
    return document(
        "What if the threshold were another one? Alignment scores to play with",
        template.render(
            experiments=shown,
            trials=max(one.sweep.trials for one in experiments),
            cameras=sum(one.sweep.trials * sum(one.counts) for one in experiments),
        ),
        styles=(source("style.css"), own("explorer.css")),
        scripts=(*map(source, SCRIPTS), own("explorer.js")),
        data={"paper": paper, "quantiles": QUANTILES, "experiments": shown},
    )


def _experiment(errors: CameraErrors) -> dict[str, Any]:
    """Return what the page needs of an experiment."""
    sweep = errors.sweep
    levels, series = _layout(sweep)
    curves = [getattr(cell, series) for cell in cells(sweep)]
    places = [tuple(getattr(cell, key) for key in levels) for cell in cells(sweep)]
    values, noise = sorted(set(curves)), sorted(set(places))
    figure, name = TITLES.get(sweep.name, ("", sweep.name))
    fixed = [(key, *getattr(sweep, key)) for key in CELL_SETTINGS if key not in (*levels, series)]
    ends = np.cumsum(np.repeat(errors.counts, sweep.trials))
    trials = np.split(errors.closest, ends[:-1]) if errors.closest.size else []
    units = [order_statistic(trial, quantile) for trial in trials for quantile in QUANTILES]
    return {
        "name": sweep.name,
        "figure": figure,
        "title": name,
        "about": [sweep.geometry, *(f"{NAMES[key]}: {write_value(key, v)}" for key, v in fixed)],
        "scores": errors.scores,
        "trials": sweep.trials,
        "cameras": errors.counts,
        "outliers": errors.outliers.tolist(),
        "levels": {
            "name": " and ".join(NAMES[key] for key in levels),
            "labels": [", ".join(map(write_value, levels, level)) for level in noise],
            "worsens": "position noise" if series == "sigma_r_deg" else "noise",
        },
        "series": {
            "name": NAMES[series],
            "labels": [write_value(series, value) for value in values],
            "colours": [to_hex(colour) for colour in colours(series, len(values))],
            "worsens": WORSE.get(series, ""),
        },
        "cells": [*zip(map(values.index, curves), map(noise.index, places), strict=True)],
        "positions": pack(errors.positions),
        "rotations": pack(errors.rotations),
        "units": pack(np.array(units)),
    }


def _layout(sweep: Sweep) -> tuple[tuple[str, ...], str]:
    """Return the settings along the x axis, and the one that curves differ in."""
    varied = [key for key in CELL_SETTINGS if len(getattr(sweep, key)) > 1]
    levels: tuple[str, ...] = ("sigma_t", "sigma_r_deg")
    if sweep.noise != "paired":
        levels = tuple(key for key in levels if key in varied)[:1] or levels[:1]
    others = [key for key in varied if key not in levels]
    if len(others) > 1:
        settings = " and ".join(others)
        raise CommandError(f"{sweep.name} varies {settings}; beside the noise a panel shows one")
    return levels, next(iter(others), "n_outliers")


def pack(values: Floats) -> Mapping[str, Any]:
    """Round positive numbers to two bytes each, on a logarithmic scale, in base64.

    0 is zero, 65535 is infinite, and those between divide the range from low to high evenly.
    """
    inside = np.isfinite(values) & (values > 0)
    finite = values[inside]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (1.0, 1.0)
    step = np.log(high / low) / (FAILURE - 2) or 1.0
    codes = np.where(np.isinf(values), FAILURE, 0)
    codes[inside] = 1 + np.round(np.log(finite / low) / step)
    return {"low": low, "high": high, "codes": b64encode(codes.astype("<u2").tobytes()).decode()}


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the page; return the exit code."""
    parser = ArgumentParser(
        prog="python -m report.explorer",
        description="Write the page that scores the errors of trials with any threshold.",
        epilog="snakemake explorer makes the errors, and the page",
    )
    parser.add_argument("errors", type=Path, metavar="CAMERA_ERRORS.npz", help="errors of cameras")
    parser.add_argument("--output", type=Path, required=True, metavar="HTML")
    return run_command(parser, _work, arguments)


def _work(options: Namespace) -> list[Path]:
    return write_files({options.output: render(read_camera_errors(options.errors)).encode()})


if __name__ == "__main__":
    sys.exit(main())
