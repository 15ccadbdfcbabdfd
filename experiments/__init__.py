"""The simulation study's trials: settings, synthetic cameras, metrics, sweeps and their tables.

All that a trial rests on is in this package, in `baselines` and in `alignscores`, and nothing else
is in this one.
"""
