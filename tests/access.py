"""The researcher of the tests: known by the key file of the data folder, and in browsers by a session.

The data folders of the tests have the same key, so that whoever calls a server needs not know which folder it
has. `use` makes every client of the tests send its proof; a stranger is a client with `auth=None`.
"""

from __future__ import annotations

from collections.abc import Generator
from functools import wraps
from pathlib import Path
from typing import Any

import httpx2

from parenting.server.access import sessions, tokens
from parenting.server.access.credentials import PORTS
from parenting.server.access.door import cookie_name
from parenting.server.access.key import FILE, proof
from parenting.server.access.roles import Role
from parenting.server.db import Database, connect
from parenting.server.settings import Settings

KEY = b"0123456789abcdef" * 4


def seed(folder: Path) -> None:
    """Write the key into a data folder, before its server makes one."""
    path = folder / FILE
    if folder.is_dir() and not path.exists():
        path.touch(0o600)
        path.write_bytes(KEY)


def bearer(port: int) -> str:
    """The header Authorization for the server at a port, for five minutes."""
    return f"Bearer {proof(KEY, port)}"


class Proof(httpx2.Auth):
    """Sends the proof with each request, unless it has a header of its own."""

    def auth_flow(self, request: httpx2.Request) -> Generator[httpx2.Request, httpx2.Response, None]:
        if "Authorization" not in request.headers:
            request.headers["Authorization"] = bearer(request.url.port or PORTS[request.url.scheme])
        yield request


def use() -> None:
    """Let every client that is made from now on be the researcher, unless it says otherwise by `auth`."""
    for kind in (httpx2.Client, httpx2.AsyncClient):
        _default(kind, "__init__")
    for verb in ("request", "stream", "get", "post", "head", "options"):
        _default(httpx2, verb)


def _default(owner: Any, name: str) -> None:
    make = getattr(owner, name)

    @wraps(make)
    def with_proof(*arguments: Any, **named: Any) -> Any:
        return make(*arguments, **{"auth": Proof(), **named})

    setattr(owner, name, with_proof)


def session(db: Database, role: Role = Role.RESEARCHER, **scope: Any) -> dict[str, str]:
    """The cookie of a browser that has entered by an opening token."""
    return {cookie_name(db): sessions.enter(db, opening(db, role, **scope)).secret}


def opening(db: Database, role: Role = Role.RESEARCHER, **scope: Any) -> str:
    """The secret of a token that lets a browser in once."""
    return tokens.make(db, "opening", role, **scope).secret


def cookies(db: Database, url: str) -> list[Any]:
    """The same for a context of Playwright."""
    return [{"name": name, "value": value, "url": url} for name, value in session(db).items()]


def cookies_in(folder: Path, url: str) -> list[Any]:
    """The same for the server of a data folder, which another process is."""
    db = connect(Settings(data=folder))
    try:
        return cookies(db, url)
    finally:
        db.close()
