import numpy as np
import pytest

from figures import style


@pytest.mark.parametrize(
    ("name", "count"), [("n_outliers", 7), ("n_cameras", 7), ("sigma_r_deg", 5)]
)
def test_series_differ_in_lightness(name, count):
    luminance = np.array(style.colours(name, count)) ** 2.2 @ [0.2126, 0.7152, 0.0722]
    lightness = 116 * np.cbrt(luminance) - 16
    assert (np.diff(lightness) > 6).all()
    assert lightness[-1] < 80  # visible on paper
