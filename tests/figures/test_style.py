import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from figures import noise, style


@pytest.mark.parametrize(
    ("name", "count"), [("n_outliers", 7), ("n_cameras", 7), ("sigma_r_deg", 5)]
)
def test_series_are_told_apart_by_lightness(name, count):
    luminance = np.array(style.colours(name, count)) ** 2.2 @ [0.2126, 0.7152, 0.0722]
    lightness = 116 * np.cbrt(luminance) - 16
    assert (np.diff(lightness) > 6).all()
    assert lightness[-1] < 80  # visible on paper


def test_the_users_own_settings_change_nothing_and_are_not_changed(run):
    trials = run("collinear")
    default = picture(noise.collinear(trials))
    own = {"font.size": 30, "lines.linewidth": 9, "axes.grid": False, "axes.facecolor": "red"}
    with matplotlib.rc_context(own):
        before = dict(matplotlib.rcParams)
        figure = noise.collinear(trials)
        assert dict(matplotlib.rcParams) == before
    assert np.array_equal(default, picture(figure))


@style.applied()
def picture(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())
