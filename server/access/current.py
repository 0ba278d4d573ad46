"""The principal of the request that is being served, for what is checked deep inside: the names in a body."""

from __future__ import annotations

from contextvars import ContextVar

from parenting.server.access.roles import Principal
from parenting.server.errors import NotAllowedError

current: ContextVar[Principal | None] = ContextVar("principal", default=None)


def own_name(name: str) -> str:
    """Return the name under which somebody answers, if it is theirs.

    Raises:
        NotAllowedError: the caller answers under another name only.
    """
    who = current.get()
    if who is not None and who.client is not None and name != who.client:
        raise NotAllowedError("You answer under one name only, and this is another one.")
    return name
