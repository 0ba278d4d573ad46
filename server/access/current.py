"""The principal of the request that is being served, for what is checked deep inside: the names in a body."""

from __future__ import annotations

from contextvars import ContextVar

from parenting.server.access.roles import Principal, Role
from parenting.server.errors import NotAllowedError

current: ContextVar[Principal | None] = ContextVar("principal", default=None)


def home() -> str:
    """Return the address of the page where the caller has their work: the list of runs, or their only run."""
    return home_of(current.get())


def home_of(who: Principal | None) -> str:
    """Return the same for somebody."""
    if who is None or who.run is None:
        return "/"
    return f"/runs/{who.run_public_id}/parent" if who.role is Role.PARENT else f"/runs/{who.run_public_id}"


def own_name(name: str) -> str:
    """Return the name under which somebody answers, if it is theirs.

    Raises:
        NotAllowedError: the caller answers under another name only.
    """
    who = current.get()
    if who is not None and who.client is not None and name != who.client:
        raise NotAllowedError("You answer under one name only, and this is another one.")
    return name
