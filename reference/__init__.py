"""The algorithm written to be read: PARENTING for one trial, in plain Python, from top to bottom.

Begin with `parenting.py`. `clips.py` holds the tuples it records, `policy.py` its network and its loss, and
`pretraining.py` the walks in mazes before and beside it. It is slow and is not installed: the tests hold the
batched agent (`agent/`) to it, query by query and parameter by parameter.
"""
