"""Snapshots of an agent's policy for pages, which the worker stores as the agent lives."""
