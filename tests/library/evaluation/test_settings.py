"""Settings: valid values, messages on others, and the parser that they define."""

import re
from dataclasses import FrozenInstanceError, fields, replace
from pathlib import Path

import numpy as np
import pytest

from alignscores import Settings, compare, evaluate
from alignscores.evaluation.settings import ABOUT, checked
from alignscores.io import FORMATS
from tests.files import FILES


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("format", "sfm", f"format must be one of {', '.join(FORMATS)}, not 'sfm'"),
        ("missing", None, "missing must be one of fail, ignore, not None"),
        ("t_max_diff", "1e", "t_max_diff must be a finite number of at least 0, not '1e'"),
        ("rate", 0, "rate must be a finite number above 0 or all, not 0"),
        ("rate", "each", "rate must be a finite number above 0 or all, not 'each'"),
        ("rate", None, "rate must be a finite number above 0 or all, not None"),
        ("max_gap", -1, "max_gap must be a finite number of at least 0, not -1"),
        ("max_gap", None, "max_gap must be a finite number of at least 0, not None"),
        ("t_offset", "guess", "t_offset must be a finite number or auto, not 'guess'"),
        ("t_offset", np.nan, "t_offset must be a finite number or auto, not nan"),
        ("frames", 5, "frames must be a file, or finite time stamps, (k,)"),
        ("frames", [0.0, np.inf], "frames must be a file, or finite time stamps, (k,)"),
        ("frames", [], "frames must be a file, or finite time stamps, (k,)"),
        ("frames", [[1.0, 2.0]], "frames must be a file, or finite time stamps, (k,)"),
        ("invert", 1, "invert must be true or false, not 1"),
        ("columns", 5, "columns must be a text, not 5"),
        ("est_topic", ["a"], "est_topic must be a text, not ['a']"),
        ("metrics", 5, "metrics must be names"),
        ("unit", 0, "unit must be a finite number above 0, not 0"),
        ("unit", True, "unit must be a finite number above 0, not True"),
        ("unit", 10**400, "unit must be a finite number above 0, not 1000"),
        ("weight", 1.1, "weight must be a finite number from 0 to 1, not 1.1"),
        ("alignment", "sim3", "alignment must be one of similarity, rigid, yaw, none, not 'sim3'"),
        (
            "alignment",
            "se3",
            "alignment must be one of similarity, rigid, yaw, none, not 'se3'; sim3 is similarity, "
            "se3 is rigid",
        ),
        ("up", "north", "up must be one of z, y, x, -z, -y, -x, not 'north'"),
        ("seed", 1.0, "seed must be a whole number of at least 0, not 1.0"),
        ("repeat", 0, "repeat must be a whole number of at least 1, not 0"),
        ("lever_arm", "1,2", "lever_arm must be X,Y,Z, each a finite number or auto"),
        ("reference_sigma", "-1,1", "reference_sigma must be X,DEG, each a finite number of at l"),
        ("metrics", "auc", "unknown metric 'auc'; close to it are auc@"),
    ],
)
def test_what_a_setting_cannot_be(name, value, message):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is compared below
        Settings(**{name: value})
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("format_name", ["kitti", "colmap", "nerf"])
@pytest.mark.parametrize("changes", [{"frames": "f"}, {"t_offset": "auto"}, {"rate": "all"}])
def test_what_needs_time_stamps_is_refused_without(format_name, changes):
    (name,) = changes
    with pytest.raises(
        ValueError, match=f"{name} needs time stamps, which {format_name} files lack"
    ):
        Settings(format=format_name, **changes)
    with pytest.raises(ValueError, match="needs time stamps"):
        replace(Settings(**changes), format=format_name)  # the format may come later


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"format": "tum", "ref_topic": "/gt"},
            "ref_topic applies only to bags: tum files have no",
        ),
        ({"format": "nerf", "metrics": "TAS,rpe@1m"}, "rpe@1m needs the order of time"),
        ({"metrics": "rpe@1s"}, "unknown metric 'rpe@1s'; close to it are rpe@1m"),
        ({"metrics": ["ATE", abs]}, "metrics must be names"),
        ({"alignment": "rigid", "up": "y"}, "up is used only by alignment=yaw: set that, too, or"),
        ({"missing": "ignore", "frames": "f"}, "frames without a pose fail"),
        ({"t_offset": "auto", "frames": "f"}, "frames need t_offset in seconds: auto would"),
    ],
)
def test_settings_that_do_not_go_together(changes, message):
    with pytest.raises(ValueError, match=message):
        Settings(**changes)


def test_they_cannot_be_changed_and_equal_ones_are_equal():
    settings = Settings(format="tum", unit=2)
    with pytest.raises(FrozenInstanceError):
        settings.unit = 3
    with pytest.raises(TypeError):
        Settings("tum")  # only by name
    assert settings == Settings(format="tum", unit=np.float64(2))
    assert len({settings, Settings(format="tum", unit=2.0), Settings()}) == 2
    stamps = np.arange(5) / 10
    assert Settings(frames=stamps) == Settings(frames=list(stamps)) != Settings(frames=stamps + 1)
    assert Settings(frames=Path("a")).frames == Path("a")


def test_metrics_have_one_name_each():
    settings = Settings(metrics="tas, half,HalfDistance,AUC@30:vggt")
    assert settings.metrics == ("TAS", "half_distance", "auc@30:vggt")
    assert Settings(metrics=["ate", "ATE"]).metrics == ("ATE",)


def test_seeds_are_drawn_by_pcr99_where_something_is_aligned():
    assert Settings(seed=3, repeat=5).seeds == range(3, 4)
    assert Settings(registration="pcr99", seed=3, repeat=5).seeds == range(3, 8)
    assert Settings(registration="pcr99", alignment="none").seeds == range(1)


def test_every_setting_has_help_and_a_default_that_it_may_have():
    assert set(ABOUT) == {field.name for field in fields(Settings)}
    for name, about in ABOUT.items():
        assert about["help"], name
        assert checked(name, getattr(Settings, name)) == getattr(Settings, name)


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("max_gap", "x", "max_gap must be a finite number of at least 0, not 'x'"),
        ("registration", "best", "registration must be one of pcr99, refined, not 'best'"),
        ("rate", "0", "rate must be a finite number above 0 or all, not '0'"),
    ],
)
def test_a_wrong_value_is_the_same_sentence_at_every_door(run, examples, name, value, sentence):
    files = [examples / file for file in FILES["tum"]]
    for door in (
        lambda: Settings(**{name: value}),
        lambda: evaluate(*files, **{name: value}),
        lambda: compare(files[0], files[1:], **{name: value}),
    ):
        with pytest.raises(ValueError, match=re.escape(sentence)):
            door()
    with pytest.raises(ValueError, match="metrics must be names"):
        evaluate(*files, metrics=5)
    pattern = files[1].with_name("{system}.txt")
    for command in (["tum", *files], ["compare", files[0], pattern]):
        code, out, err = run(*command, f"--{name}", value)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert f": error: {sentence}; see alignscores" in err
