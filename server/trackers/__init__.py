"""Trackers: other programs that follow a training, fed outside of its ticks by the worker and by `pt.train`.

`tracker.py` has the hook, `feed.py` the thread that calls it, `writers.py` CSV and JSON lines, and
`choosing.py` the names by which a setting or an argument chooses one.
"""
