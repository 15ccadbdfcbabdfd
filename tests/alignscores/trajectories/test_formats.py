"""What there is to each format."""

import inspect

import pytest

from alignscores.trajectories import files
from alignscores.trajectories.formats import FORMATS

FLAGS = "missing", "timed", "quaternions", "topics", "ordered"


@pytest.mark.parametrize(
    ("name", "flags", "unit", "aligned"),
    [
        ("tum", "missing timed quaternions ordered", "m", "TUM"),
        ("kitti", "ordered", "m", "KITTI"),
        ("euroc", "missing timed quaternions ordered", "m", "TUM"),
        ("colmap", "missing quaternions", "units", ""),
        ("vslamlab", "missing timed quaternions ordered", "m", "TUM"),
        ("arrays", "missing timed ordered", "m", "TUM or KITTI"),
        ("bag", "missing timed quaternions topics ordered", "m", "TUM"),
        ("nerf", "missing", "units", ""),
    ],
)
def test_a_format(name, flags, unit, aligned):
    form = FORMATS[name]
    assert [flag for flag in FLAGS if getattr(form, flag)] == flags.split()
    assert (form.unit, form.aligned) == (unit, aligned)
    assert form.read is getattr(files, f"read_{name}")
    assert form.read_parts is (files.read_colmap_parts if name == "colmap" else None)


@pytest.mark.parametrize("name", FORMATS)
def test_an_estimate_may_be_incomplete_in_each_format(name):
    """Which is the default, by name alone."""
    complete = inspect.signature(FORMATS[name].read).parameters["complete"]
    assert (complete.default, complete.kind) == (False, complete.KEYWORD_ONLY)


def test_all_formats_are_here():
    assert list(FORMATS) == ["tum", "kitti", "euroc", "colmap", "vslamlab", "arrays", "bag", "nerf"]
