"""The figures, drawn from tables of results: ``python -m figures NAME TABLE.csv --output PATH``."""

from studies.parameters import KINDS

__all__ = ["FIGURES", "PAPER_FIGURES"]

PAPER_FIGURES: dict[str, tuple[str, ...]] = {
    "histogram": ("combined",),  # one trial under its settings
    "outliers": ("outliers",),
    "collinear": ("collinear",),
    "trajectory_length": ("trajectory_length",),
    "rotations": ("rotations",),
    "combined": ("combined",),
    "maa_vs_pas": ("maa_vs_pas_outliers", "maa_vs_pas_length", "maa_vs_pas_collinear"),
}
"""The figures of the paper, each with the experiments whose trials it shows."""

FIGURES: dict[str, tuple[str, ...]] = {
    **{name: tuple(f"trials/{one}" for one in of) for name, of in PAPER_FIGURES.items()},
    "threshold_study": tuple(f"tables/threshold_study_{kind}" for kind in KINDS),
    "threshold_maps": ("tables/threshold_maps",),
    "registration_study": ("tables/registration_study",),
    "beyond": ("tables/beyond",),
    "frame_rate": ("tables/frame_rate",),
    "today": ("tables/today",),
    "paths": (),
}
"""All figures, each with the tables that it is drawn from; the module of its name draws it.

Snakemake reads this before anything runs, so it must not cost an import of Matplotlib.
"""
