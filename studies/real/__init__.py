"""Real runs: which metric orders the systems of a benchmark."""

from ..study import Study

STUDY = Study(
    name="real",
    title="Your own runs",
    text="Order: how often two runs, one of each system, come in the order of the systems by all "
    "runs of the metric; equal: with one pose a second of each estimate; agrees: in the order by "
    "another metric. Significant: on how many sequences and pairs of systems the difference is. "
    "Runs: how many of each system a rank-sum test needs. Offsets of clocks are removed first.",
    alt="Left, a row for each metric with the share of pairs of runs in the right order for each "
    "pair of systems. Then a matrix of metrics by metrics: how often runs come in the order by "
    "another metric.",
    position=110,
    keys=["benchmark", "more"],
)
