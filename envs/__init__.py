"""The worlds. They know nothing of agents, parents or databases. (Imports no torch: see tests/test_layers.py.)"""
