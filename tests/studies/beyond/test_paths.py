from experiments.scenes import PATHS
from studies.beyond import paths


def test_every_path_that_the_paper_leaves_out_is_shown():
    shown = {axes.get_title(loc="left") for axes in paths.draw().axes}
    assert shown == set(PATHS) - {"cube", "line", "x_axis", "ray", "laps"}
