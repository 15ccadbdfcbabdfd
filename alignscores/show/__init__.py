"""Presentation of evaluations and comparisons: tables, plots, pages, recordings."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeGuard

from ..evaluation.evaluation import Evaluation
from ..extras import require
from ..writing import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..comparison import Comparison

__all__ = ["PLOT_MODES", "plot", "save_page"]

PLOT_MODES = "xy", "xz", "yz", "xyz"  # axes of trajectories


def plot(
    shown: "Evaluation | Sequence[Evaluation] | Comparison",
    kind: str | None = None,
    *,
    plot_mode: str | None = None,
) -> "Figure":
    """Draw one estimate, several of the same reference, or a comparison, with Matplotlib.

    Parameters
    ----------
    shown : Evaluation, sequence of Evaluation, or Comparison
        What `evaluate` or `compare` returns. Of a comparison, the runs and the differences of the
        systems are drawn.
    kind : {"trajectory", "scores", "errors", "time"}, optional
        Of estimates: the aligned trajectory, of a single estimate coloured by its error; frames
        below each threshold; errors over time, shaded where the estimate is lost, under the
        stretches that cost the scores most; or positions and angles over time. By default all of
        them.
    plot_mode : {"xy", "xz", "yz", "xyz"}, optional
        Axes of the trajectory; by default the two longest.

    Returns
    -------
    matplotlib.figure.Figure
        A figure of pyplot, which ``plt.show()`` shows.

    Raises
    ------
    ModuleNotFoundError
        If Matplotlib is not installed.
    ValueError
        If `kind` or `plot_mode` is unknown, or given for a comparison.

    Examples
    --------
    >>> from alignscores import evaluate, plot
    >>> evaluation = evaluate("tests/data/tum/reference.txt", "tests/data/tum/estimate.txt")
    >>> figure = plot(evaluation, "errors")
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['position error [m]', 'rotation error [deg]']
    """
    require("matplotlib", "plots")
    if _is_comparison(shown):
        if kind or plot_mode:
            raise ValueError("kind and plot_mode apply only to estimates, not to a comparison")
        from .comparison_plot import figure_of_comparison

        return figure_of_comparison(shown, interactive=True)
    from .plots import figure_of

    return figure_of(_as_list(shown), kind, plot_mode=plot_mode, interactive=True)


def save_page(
    shown: "Evaluation | Sequence[Evaluation] | Comparison", path: str | PathLike[str]
) -> None:
    """Write a page of one estimate, of several of the same reference, or of a comparison.

    The page is one file, which needs no network. Of estimates it has the table of the command with
    its conditions and all notes, where the scores are lost, the aligned trajectories in 3D, the
    errors over time, and the scores over their thresholds. Of a comparison it has the verdict, all
    notes, the tables, the differences of the systems, all runs, and the errors over time.

    Parameters
    ----------
    shown : Evaluation, sequence of Evaluation, or Comparison
        What `evaluate` or `compare` returns.
    path : path
        File to write, such as ``scores.html``.

    Raises
    ------
    ModuleNotFoundError
        If plotly or Jinja is not installed.
    ValueError
        If the file cannot be written.

    Examples
    --------
    >>> from alignscores import evaluate, save_page
    >>> evaluation = evaluate("tests/data/tum/reference.txt", "tests/data/tum/estimate.txt")
    >>> save_page(evaluation, "scores.html")  # doctest: +SKIP
    """
    for package in ("plotly", "jinja2"):
        require(package, "page")
    if _is_comparison(shown):
        from .comparison_page import page_of_comparison

        content = page_of_comparison(shown)
    else:
        from .page import page_of

        content = page_of(_as_list(shown))
    write_whole(Path(path), content.encode())


def _is_comparison(shown: Any) -> "TypeGuard[Comparison]":
    """Return whether it is a comparison, without an import of pandas."""
    return type(shown).__name__ == "Comparison"


def _as_list(shown: Any) -> list[Evaluation]:
    """Return a list of evaluations of one reference; raise ValueError for none."""
    evaluations = [shown] if isinstance(shown, Evaluation) else list(shown)
    if not evaluations:
        raise ValueError("there is no evaluation to show")
    return evaluations
