"""Benchmarks. Nothing imports these files; each is a command of its own."""
