"""The command ``alignscores compare``: systems over sequences and runs, with their uncertainty.

`patterns` and `benchmark` find the runs, `runs` scores them, `summary` takes their means, with
the statistics of `intervals`; `tables` and `page` show them.
"""
