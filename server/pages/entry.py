"""The way in: an address that carries a token once, and a cookie from then on.

The GET changes nothing: a mail scanner or a preview may look at the address. Its page sends a form by itself,
or by its button without JavaScript, and that POST uses the token up and sets the cookie.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

from fastapi import Form, Query, Request, Response

from parenting.server import runs
from parenting.server.access import sessions
from parenting.server.access.door import Door
from parenting.server.access.sessions import Entered
from parenting.server.access.tables import AccessSession
from parenting.server.admission import admitted_router
from parenting.server.db import Database
from parenting.server.deps import Db
from parenting.server.errors import UsedUpError
from parenting.server.pages.render import page, redirect
from parenting.server.public_ids import ALPHABET, LENGTH

router = admitted_router(include_in_schema=False)

ADDRESS = "/open"
LONGEST = 100
Token = Annotated[str, Query(max_length=LONGEST)]
RUN_PAGE = rf"^/runs/[{ALPHABET}]{{{LENGTH}}}(/parent)?$"
To = Annotated[str | None, Query(pattern=RUN_PAGE)]
ToField = Annotated[str | None, Form(pattern=RUN_PAGE)]
"""A page of this house to go to; no other address."""
TokenField = Annotated[str, Form(max_length=LONGEST)]


@router.get(ADDRESS)
def entry_page(request: Request, db: Db, token: Token = "", to: To = None) -> Response:
    """The page that sends the token as a form; a token that opens nothing gets 410."""
    with _guess(request):
        sessions.require_valid(db, token)
    return page("open.html", token=token, to=to)


@router.post(ADDRESS)
def enter(request: Request, db: Db, token: TokenField, to: ToField = None) -> Response:
    """For the form: begin a session, and go to the page of a run, or where the role has its work."""
    door = _door(request)
    with _guess(request):
        entered = sessions.enter(db, token, request.cookies.get(door.cookie), days=door.days)
    door.forget()
    response = redirect(to or _first_page(db, entered.session))
    _set_cookie(request, response, entered)
    return response


@router.post("/leave")
def leave(request: Request, db: Db) -> Response:
    """End the session of this browser."""
    door = _door(request)
    sessions.end(db, request.cookies.get(door.cookie, ""))
    door.forget()
    response = redirect("/")
    response.delete_cookie(door.cookie, httponly=True, samesite="lax")
    return response


def _door(request: Request) -> Door:
    door: Door = request.app.state.door
    return door


@contextmanager
def _guess(request: Request) -> Iterator[None]:
    """Count a token that opens nothing; the guard refuses an address that has brought too many."""
    try:
        yield
    except UsedUpError:
        _door(request).guesses.wrong(request.client.host if request.client else "")
        raise


def _first_page(db: Database, session: AccessSession) -> str:
    if session.run_id is None:
        return "/"
    run = runs.get_run(db, session.run_id)
    return f"/runs/{run.public_id}" + ("/parent" if session.role == "parent" else "")


def _set_cookie(request: Request, response: Response, entered: Entered) -> None:
    door = _door(request)
    seconds = (entered.session.expires - entered.session.created).total_seconds()
    response.set_cookie(
        door.cookie,
        entered.secret,
        max_age=int(seconds),
        httponly=True,
        samesite="lax",
        secure=request.scope["scheme"] == "https",
    )
