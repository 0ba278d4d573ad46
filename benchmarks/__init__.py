"""Benchmarks. Nothing imports these files; each is a command of its own, and the researcher of its server."""

from tests import access

access.use()
