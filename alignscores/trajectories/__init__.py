"""User-supplied trajectories: files, clocks and mix-ups of convention.

No score rests on anything in here: `tas`, `ras` and `pas` take arrays.
"""
