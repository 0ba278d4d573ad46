"""Open files: each connection is one, and a process that has none left refuses everybody in silence."""

from __future__ import annotations

import resource

from parenting.server.errors import SetupError

RESERVE = 256
"""Files of the process besides its connections: database connections, sockets, logs, libraries."""
LEAST = 32
"""Fewer connections than this cannot serve a few browsers."""
MOST = 65_536
"""More files than this are never asked for; some systems allow a billion, and tables grow with the limit."""


def room_for(connections: int) -> int:
    """Raise the limit of open files as far as is allowed, and return how many connections fit, at most.

    Args:
        connections: The number that the settings allow.

    Raises:
        SetupError: too few files are allowed to serve anybody.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = MOST if hard == resource.RLIM_INFINITY else min(hard, MOST)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
        soft = wanted
    fit = connections if soft == resource.RLIM_INFINITY else min(connections, soft - RESERVE)
    if fit < min(LEAST, connections):
        raise SetupError(
            f"This process may open {soft} files; {RESERVE + min(LEAST, connections)} are needed. "
            f"Raise the limit: ulimit -n {RESERVE + connections} (systemd: LimitNOFILE)."
        )
    return fit
