"""The template of a request's route, by which requests are counted and let in."""

from __future__ import annotations

from starlette.types import Scope

NO_ROUTE = "none"
"""The label of an address that no route has; the address itself may be anything."""


def route_of(scope: Scope) -> str:
    """Return the template of a request's route: a few words for all the addresses that there are."""
    whole = scope.get("fastapi", {}).get("effective_route_context")  # with the prefix of an included router
    path = getattr(whole or scope.get("route"), "path", None)
    return path or scope.get("root_path") or NO_ROUTE
