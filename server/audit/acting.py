"""The actor: set once for a request, read where something is done."""

from __future__ import annotations

import getpass
import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

SOMEBODY = "somebody"
"""A caller of whom nothing is known."""


@dataclass
class Actor:
    """The actor of a request. The guard of a request fills in `who` once it knows."""

    who: str = SOMEBODY
    client: str | None = None


_acting: ContextVar[Actor | None] = ContextVar("acting", default=None)


@contextmanager
def a_request(client: str) -> Iterator[Actor]:
    """Yield who acts while a request is served: somebody at this address."""
    actor = Actor(client=client or None)
    token = _acting.set(actor)
    try:
        yield actor
    finally:
        _acting.reset(token)


def acting() -> Actor:
    """Return who acts: outside of a request whoever runs this program on the machine."""
    return _acting.get() or Actor(f"command line ({_user()})")


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # a container's user has no name
        return f"user {os.getuid()}"
