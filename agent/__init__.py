"""PARENTING, the algorithm of Sec. 2.

Start reading at `agent.parenting`. This file imports no torch: see tests/test_layers.py.
"""
