"""The figures of the paper, drawn from the tables of trials: ``python -m figures NAME``."""

__all__ = ["FIGURES", "HISTOGRAM_EXPERIMENT", "STUDIES"]

FIGURES: dict[str, tuple[str, ...]] = {
    "histogram": (),
    "outliers": ("outliers",),
    "collinear": ("collinear",),
    "trajectory_length": ("trajectory_length",),
    "rotations": ("rotations",),
    "combined": ("combined",),
    "maa_vs_pas": ("maa_vs_pas_outliers", "maa_vs_pas_length", "maa_vs_pas_collinear"),
}
"""Each figure with the experiments that its data come from; it is drawn by the module of its name.

Snakemake reads this before anything runs, so it must not cost an import of Matplotlib.
"""

STUDIES: dict[str, tuple[str, ...]] = {
    "threshold_study": ("_tas", "_ras", "_pas", "_registration"),
    "registration_study": ("",),
}
"""Figures of the parameter studies, with the tables that they are drawn from, joined."""

HISTOGRAM_EXPERIMENT = "combined"
"""The experiment whose settings the one trial in the histogram is run with."""
