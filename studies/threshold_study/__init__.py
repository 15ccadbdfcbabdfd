"""What the numbers that the paper chose by experience cost and gain."""

from collections.abc import Sequence

import pandas as pd

from experiments.tables import Trials

from ..study import Study
from .axes import axes_of, axis_names, plan
from .effects import effects


def answer(trials: Sequence[Trials], n_jobs: int = 1) -> list[pd.DataFrame | str]:
    """Return the effects of all values."""
    by_name = {table.path.stem: table for table in trials}
    parts = {name: table.table for name, table in by_name.items()}
    return [effects(axes_of(by_name["outliers"].record.metrics), parts)]


STUDY = Study(
    name="threshold_study",
    title="Thresholds",
    text="Each value of an option is compared with the paper's on the same cameras, one option at "
    "a time. Order: how often two trials at neighbouring levels come in the right order; 50 % is "
    "chance. Most lost: four of five cameras are outliers. Noise range: of the mean scores. "
    "Cameras: how far the mean moves with their number.",
    alt="A row for each value of each option, and five columns of effects: order of noise, of "
    "outliers, of noise where most cameras are lost, range over noise, and dependence on cameras. "
    "The paper's values are filled dots.",
    plan=plan,
    answer=answer,
    position=20,
    keys=axis_names(),
)
