"""The work that a process does once, done by the server of forks (`processes`) before it makes any.

A web process works out what its routes need and compiles its templates, which takes it two seconds of the
processor on a slow machine; a worker's first tick is slow, too. Each fork has this from its first moment on.
"""

import torch
from sqlalchemy.orm import configure_mappers

from parenting.server.app import _warm, bare_app
from tests.server.raising import Inline

TICKS = 2
"""Ticks of an agent that nobody uses: enough that each step of one was taken."""

torch.set_num_threads(1)  # threads do not outlive a fork
configure_mappers()
_warm(bare_app())
_agent = Inline()
for _ in range(TICKS):
    _agent.tick()
del _agent
