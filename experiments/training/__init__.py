"""Trains many agents at once, and records how they end."""
