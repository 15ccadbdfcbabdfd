"""What people see of evaluations: tables, plots, pages and recordings, by functions."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..evaluation.evaluation import Evaluation
from ..extras import require
from ..writing import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["PLOT_MODES", "plot", "save_page"]

PLOT_MODES = "xy", "xz", "yz", "xyz"  # axes of trajectories


def plot(
    evaluations: Evaluation | Sequence[Evaluation],
    kind: str | None = None,
    *,
    plot_mode: str | None = None,
) -> "Figure":
    """Draw one estimate, or several of the same reference, with Matplotlib.

    Parameters
    ----------
    evaluations : Evaluation or sequence of Evaluation
        What `evaluate` returns.
    kind : {"trajectory", "scores", "errors", "time"}, optional
        The aligned trajectory, of a single estimate coloured by its error; frames below each
        threshold; errors over time, shaded where the estimate is lost, under the stretches that
        cost the scores most; or positions and angles over time. By default all of them.
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
        If `kind` or `plot_mode` is unknown.

    Examples
    --------
    >>> from alignscores import evaluate, plot
    >>> evaluation = evaluate("tests/data/tum/reference.txt", "tests/data/tum/estimate.txt")
    >>> figure = plot(evaluation, "errors")
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['position error [m]', 'rotation error [deg]']
    """
    require("matplotlib", "plots")
    from .plots import figure_of

    return figure_of(_several(evaluations), kind, plot_mode=plot_mode, interactive=True)


def save_page(evaluations: Evaluation | Sequence[Evaluation], path: str | PathLike[str]) -> None:
    """Write a page of one estimate, or of several of the same reference: a file without network.

    It has the table of the command with its conditions and all notes, where the scores are lost,
    the aligned trajectories in 3D, the errors over time, and the scores over their thresholds.

    Parameters
    ----------
    evaluations : Evaluation or sequence of Evaluation
        What `evaluate` returns.
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
    from .page import page_of

    write_whole(Path(path), page_of(_several(evaluations)).encode())


def _several(evaluations: Any) -> list[Evaluation]:
    """Return a list of evaluations of one reference; raise ValueError for none."""
    several = [evaluations] if isinstance(evaluations, Evaluation) else list(evaluations)
    if not several:
        raise ValueError("there is no evaluation to show")
    return several
