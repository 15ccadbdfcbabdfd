"""Settings: values that they may have, what is said of others, and the parser made from them."""

import argparse
from dataclasses import FrozenInstanceError, fields, replace
from pathlib import Path

import numpy as np
import pytest

from alignscores import Settings
from alignscores.cli.command import build_parser
from alignscores.evaluation.settings import Option, options, order_problem
from alignscores.trajectories.formats import FORMATS


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("format", "sfm", f"format must be one of {', '.join(FORMATS)}, not 'sfm'"),
        ("est_format", 3, f"est_format must be one of {', '.join(FORMATS)}, not 3"),
        ("missing", "skip", "missing must be one of fail, ignore, not 'skip'"),
        ("missing", None, "missing must be one of fail, ignore, not None"),
        ("t_max_diff", -0.1, "t_max_diff must be a finite number of at least 0, not -0.1"),
        ("t_max_diff", "0.1", "t_max_diff must be a finite number of at least 0, not '0.1'"),
        ("t_offset", "guess", "t_offset must be a finite number or auto, not 'guess'"),
        ("t_offset", np.nan, "t_offset must be a finite number or auto, not nan"),
        ("frames", 5, "frames must be a file, or finite time stamps, (k,)"),
        ("frames", [0.0, np.inf], "frames must be a file, or finite time stamps, (k,)"),
        ("frames", [], "frames must be a file, or finite time stamps, (k,)"),
        ("frames", {"a": 1}, "frames must be a file, or finite time stamps, (k,)"),
        ("invert", "no", "invert must be true or false, not 'no'"),
        ("invert", 1, "invert must be true or false, not 1"),
        ("body_rotation", True, "body_rotation must be one of auto, none, not True"),
        ("unit", 0, "unit must be a finite number above 0, not 0"),
        ("unit", -1.0, "unit must be a finite number above 0, not -1.0"),
        ("unit", True, "unit must be a finite number above 0, not True"),
        ("max_threshold", None, "max_threshold must be a finite number above 0, not None"),
        ("max_threshold_deg", np.inf, "max_threshold_deg must be a finite number above 0, not inf"),
        ("weight", 1.1, "weight must be a finite number from 0 to 1, not 1.1"),
        ("registration", "none", "registration must be one of pcr99, refined, not 'none'"),
        ("alignment", "sim3", "alignment must be one of similarity, rigid, yaw, none, not 'sim3'"),
        ("alignment", None, "alignment must be one of similarity, rigid, yaw, none, not None"),
        ("up", "north", "up must be one of z, y, x, -z, -y, -x, not 'north'"),
        ("seed", -1, "seed must be a whole number of at least 0, not -1"),
        ("seed", 1.0, "seed must be a whole number of at least 0, not 1.0"),
        ("repeat", 0, "repeat must be a whole number of at least 1, not 0"),
        ("metrics", "auc", "unknown metric 'auc'; close to it are auc@30:vggt"),
        ("metrics", ("TAS", ""), "unknown metric ''; close to it are "),
    ],
)
def test_what_a_setting_cannot_be(name, value, message):
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the message is compared below
        Settings(**{name: value})
    assert str(caught.value).startswith(message)
    with pytest.raises(ValueError, match=name if name != "metrics" else "unknown metric"):
        replace(Settings(), **{name: value})


@pytest.mark.parametrize("form", ["kitti", "colmap", "nerf"])
@pytest.mark.parametrize("changes", [{"frames": "f"}, {"t_offset": "auto"}, {"t_max_diff": 1}])
def test_what_needs_time_stamps_is_refused_without(form, changes):
    (name,) = changes
    with pytest.raises(ValueError, match=f"{name} needs time stamps, which {form} files lack"):
        Settings(format=form, **changes)
    Settings(format="tum", **changes)
    Settings(**changes)  # the format may come later
    with pytest.raises(ValueError, match="needs time stamps"):
        replace(Settings(**changes), format=form)


def test_frames_that_were_due_are_told_as_they_were_given():
    for frames in ("frames.txt", (1.0, 2.5)):
        assert Settings(format="tum", frames=frames).to_dict()["frames"] == frames
    assert Settings(format="tum", frames="a\x1b[1m.txt").to_dict()["frames"] == "a\\x1b[1m.txt"


def test_a_topic_is_refused_where_the_format_has_none():
    with pytest.raises(ValueError, match="ref_topic is of bags, and tum files have no topics"):
        Settings(format="tum", ref_topic="/gt")
    assert Settings(format="bag", est_format="tum", ref_topic="/gt").ref_topic == "/gt"


def test_what_needs_an_order_of_time_is_refused_without():
    message = "rpe@1m needs cameras in the order of time, but images are matched by name"
    with pytest.raises(ValueError, match=message):
        Settings(format="nerf", metrics="TAS,rpe@1m")
    assert Settings(format="kitti", metrics="rpe@1m").metrics == ("rpe@1m",)


def test_they_cannot_be_changed_and_equal_ones_are_equal():
    settings = Settings(format="tum", unit=2)
    with pytest.raises(FrozenInstanceError):
        settings.unit = 3
    with pytest.raises(TypeError):
        Settings("tum")  # by name alone
    assert settings == Settings(format="tum", unit=np.float64(2))
    assert settings != replace(settings, seed=1)
    assert len({settings, Settings(format="tum", unit=2.0), Settings()}) == 2
    stamps = np.arange(5) / 10
    assert Settings(frames=stamps) == Settings(frames=list(stamps)) == Settings(frames=stamps)
    assert Settings(frames=stamps) != Settings(frames=stamps + 1)
    assert len({Settings(frames=stamps), Settings(frames=stamps.tolist())}) == 1
    assert Settings(frames=Path("a")).frames == Path("a")


def test_numbers_are_python_s():
    settings = Settings(seed=np.int64(3), unit=np.float32(0.5), max_threshold=2)
    assert [type(value) for value in (settings.seed, settings.unit, settings.max_threshold)] == [
        *(int, float, float)
    ]


def test_metrics_have_one_name_each():
    settings = Settings(metrics="tas, recall@5cm,5deg:hloc-sim3,half,HalfDistance,AUC@30:vggt")
    assert settings.metrics == ("TAS", "recall@5cm,5deg:hloc-sim3", "half_distance", "auc@30:vggt")
    assert Settings(metrics=["ate", "ATE"]).metrics == ("ATE",)


def test_seeds():
    assert Settings(seed=3, repeat=5).seeds == range(3, 4)
    assert Settings(registration="pcr99", seed=3, repeat=5).seeds == range(3, 8)


def test_without_an_alignment_there_is_nothing_to_draw():
    assert Settings(registration="pcr99", alignment="none").seeds == range(1)
    assert len(Settings(registration="pcr99", alignment="rigid").seeds) == 10


@pytest.mark.parametrize("alignment", ["similarity", "rigid", "none"])
def test_a_vertical_axis_is_refused_where_none_is_used(alignment):
    with pytest.raises(ValueError, match="up is used by alignment=yaw alone: set that, too, or"):
        Settings(alignment=alignment, up="y")
    settings = Settings(format="tum", alignment="yaw", up="y")
    assert (settings.to_dict()["alignment"], settings.to_dict()["up"]) == ("yaw", "y")
    with pytest.raises(ValueError, match="up is used by"):
        replace(settings, alignment=alignment)
    assert Settings(format="tum", alignment=alignment).to_dict()["up"] is None


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "registration refined"),
        ({"registration": "pcr99"}, "registration pcr99"),
        ({"alignment": "rigid"}, "registration refined, aligned without scale"),
        (
            {"alignment": "yaw", "up": "-y", "registration": "pcr99"},
            "registration pcr99, aligned about the y axis, without scale",
        ),
        ({"alignment": "none"}, "not aligned"),
    ],
)
def test_how_aligned(changes, words):
    assert Settings(**changes).how_aligned == words


def test_missing_cameras():
    assert Settings(format="tum").missing_cameras == "fail"
    assert Settings(format="tum", missing="ignore").missing_cameras == "ignore"
    assert Settings(format="tum", frames="f").missing_cameras == "fail"
    with pytest.raises(ValueError, match="frames without a pose fail"):
        Settings(format="tum", missing="ignore", frames="f")
    assert Settings(format="kitti").missing_cameras is None


def test_without_a_format():
    with pytest.raises(ValueError, match="give the format of the files: format=tum"):
        _ = Settings().form


def test_every_setting_has_help():
    assert set(options()) == {field.name for field in fields(Settings)}
    for name, option in options().items():
        assert option.help, name
        assert option.group, name
        assert option.checked(getattr(Settings, name)) == getattr(Settings, name)


def parsers():
    """Return the parser of each format, and of the comparison, by name."""
    actions = {action.dest: action for action in build_parser()._actions}
    return actions["format"].choices


@pytest.mark.parametrize("command", [*FORMATS, "compare"])
def test_the_parser_is_made_from_them(command):
    """Of a format it has the settings that there are for it, each with its default and its help."""
    actions = {action.dest: action for action in parsers()[command]._actions}
    assert all(action.help for action in actions.values())
    expected = set(options()) - {"format"}
    if command != "compare":
        form = FORMATS[command]
        expected -= {name for name, option in options().items() if option.timed and not form.timed}
        expected -= set() if form.missing else {"missing", "est_format"}
        expected -= set() if form.topics else {"ref_topic", "est_topic"}
    assert expected == set(options()) & set(actions)
    for name in expected:
        action, option = actions[name], options()[name]
        assert action.default == getattr(Settings, name)
        if (command, name) != ("compare", "frames"):  # a pattern there
            assert option.help in action.help
        if option.choices and name != "est_format":
            assert tuple(action.choices) == option.choices
        if option.number:
            for text in ("x", "nan", "-1", "0", "1", "0.5", "1e400", *option.words):
                try:
                    value = action.type(text)
                except argparse.ArgumentTypeError as error:
                    assert str(error).startswith("must be a")  # noqa: PT017
                else:
                    assert getattr(Settings(**{name: value}), name) == value


DEFAULTS = {
    **dict.fromkeys(("format", "est_format", "ref_topic", "est_topic"), None),
    "missing": "fail",
    "t_max_diff": 0.01,
    "sync": "interpolate",
    **dict.fromkeys(("max_gap", "t_start", "t_end"), None),
    "t_offset": 0.0,
    "frames": None,
    "invert": False,
    "body_rotation": "none",
    "unit": None,
    "max_threshold": 1.0,
    "max_threshold_deg": 10.0,
    "weight": 0.5,
    "registration": "refined",
    "alignment": "similarity",
    "up": "z",
    "seed": 0,
    "repeat": 10,
    "metrics": (),
}


def test_the_defaults():
    assert vars(Settings()) == DEFAULTS
    assert options() is options()


def test_what_is_not_said_of_an_option():
    assert vars(Option("what it is", group="scoring")) == {
        "help": "what it is",
        "group": "scoring",
        "choices": (),
        "number": None,
        "least": -np.inf,
        "most": np.inf,
        **dict.fromkeys(("positive", "flag", "optional", "timed", "topics"), False),
        "words": (),
    }


@pytest.mark.parametrize(
    ("name", "values"),
    [
        *[("weight", (0, 1, 0.5)), ("t_max_diff", (0, 1e300)), ("seed", (0, 10**18))],
        *[("repeat", (1, 2)), ("t_offset", (-1e9, 0, "auto")), ("unit", (1e-300, None))],
        *[("t_start", (-5, None)), ("max_gap", (0, None)), ("invert", (True, False))],
    ],
)
def test_what_a_setting_may_be(name, values):
    for value in values:
        assert getattr(Settings(**{name: value}), name) == value


@pytest.mark.parametrize("name", ["unit", "seed", "t_offset"])
def test_whole_numbers_beyond_all_floats_are_refused(name):
    for value in (10**400, -(10**400)):
        with pytest.raises(ValueError, match=f"^{name} must be a "):
            Settings(**{name: value})


def test_frames_become_numbers():
    frames = Settings(frames=["1.5", 2]).frames
    assert frames == (1.5, 2.0)
    assert [type(frame) for frame in Settings(frames=[1, 2]).frames] == [float, float]
    with pytest.raises(ValueError, match=r"^frames must be a file, or finite time stamps"):
        Settings(frames=[[1.0, 2.0]])


def test_settings_as_json_has_them():
    changes = {
        "est_format": "tum",
        "missing": "ignore",
        "t_max_diff": 0.5,
        "t_offset": 2,
        "sync": "nearest",
        "max_gap": 3,
        "t_start": 4,
        "t_end": 5,
        "unit": 6,
        "max_threshold": 7,
        "max_threshold_deg": 8,
        "weight": 0.75,
        "registration": "pcr99",
        "alignment": "yaw",
        "up": "-y",
        "seed": 9,
        "repeat": 11,
    }
    expected = {
        "format": "euroc",
        "ref_topic": None,
        "est_topic": None,
        **{key: value for key, value in changes.items() if key != "missing"},
        "missing_cameras": "ignore",
        "frames": None,
        "inverted": True,
        "body_rotation": "auto",
    }
    found = Settings(format="euroc", invert=True, body_rotation="auto", **changes).to_dict()
    assert found == expected
    assert Settings(format="tum").to_dict() == {
        **expected,
        "format": "tum",
        "est_format": "tum",
        "missing_cameras": "fail",
        **{key: DEFAULTS[key] for key in changes if key in expected and key != "est_format"},
        "up": None,
        "repeat": 1,
        "inverted": False,
        "body_rotation": "none",
    }
    kitti = Settings(format="kitti").to_dict()
    timed = "t_max_diff", "t_offset", "sync", "missing_cameras"
    assert [kitti[name] for name in timed] == [None] * 4
    bag = Settings(format="bag", ref_topic="/a", est_topic="/b").to_dict()
    assert (bag["ref_topic"], bag["est_topic"]) == ("/a", "/b")


def test_metrics_may_need_an_order_or_stamps():
    for form, problem in (
        ("tum", ""),
        ("kitti", ""),
        ("nerf", "rpe@1m needs cameras in the order of time, but images are matched by name"),
    ):
        assert order_problem(("TAS", "rpe@1m"), FORMATS[form]) == problem
    assert order_problem(("TAS", "auc@30:vggt"), FORMATS["nerf"]) == ""
    assert order_problem(("TAS", "rpe@1s"), FORMATS["tum"]) == ""
    said = "rpe@1s needs time stamps, which the files lack"
    assert order_problem(("rpe@1m", "rpe@1s"), FORMATS["kitti"]) == said
