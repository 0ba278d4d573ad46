"""The worlds. They know nothing of agents, parents or databases.

This file loads no torch (tests/test_layers.py).
"""
