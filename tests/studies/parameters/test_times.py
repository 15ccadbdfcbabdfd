"""Run times of the values of a study's axes."""

from experiments.tables import Trials
from studies.parameters.axes import Axis, load_parameters
from studies.parameters.times import measure


def test_times_are_of_every_value_and_number_of_cameras(
    axes: list[Axis], parts: dict[str, Trials]
) -> None:
    few = load_parameters("threshold", ["n_cameras=[20,200]", "n_outliers=[0]"]).tables["seeds"]
    times = measure(axes, few.sweeps)
    keys = ["n_cameras", "axis", "metric", "option", "value"]
    assert times[keys].to_numpy().tolist() == [
        [n, axis.name, axis.metric, axis.option, value]
        for n in (20, 200)
        for axis in axes
        for value in axis.values
    ]
    assert (times["milliseconds"] > 0).all()
    tas = times[times["axis"] == "registration_n_hypotheses"].set_index(["n_cameras", "value"])
    assert tas["milliseconds"][200, "1000"] > tas["milliseconds"][20, "30"]
