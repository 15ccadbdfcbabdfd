"""People's own trajectories: files, association, mix-ups of convention, and metrics for evo.

No score rests on anything in here: `tas`, `ras` and `pas` take arrays.
"""
