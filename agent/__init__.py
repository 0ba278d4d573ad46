"""PARENTING, the algorithm of Sec. 2. Start reading at `agent.parenting`. (Imports no torch here: see
tests/test_layers.py.)
"""
