"""The way in: an address that carries a token once, and a cookie from then on.

The GET changes nothing: a mail scanner or a preview may look at the address. Its page sends a form by itself,
or by its button without JavaScript, and that POST uses the token up and sets the cookie.
"""

from __future__ import annotations

from typing import Annotated

from fastapi import Form, Query, Request, Response

from parenting.server import runs
from parenting.server.access import sessions
from parenting.server.access.current import home_of
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
    try:
        sessions.require_valid(db, token)
    except UsedUpError:
        return _again(request, db, token, to)
    return page("open.html", token=token, to=to)


@router.post(ADDRESS)
def enter(request: Request, db: Db, token: TokenField, to: ToField = None) -> Response:
    """For the form: begin a session, and go to the page of a run, or where the role has its work."""
    door = _door(request)
    try:
        entered = sessions.enter(db, token, request.cookies.get(door.cookie), days=door.days)
    except UsedUpError:
        return _again(request, db, token, to)
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


def _again(request: Request, db: Database, token: str, to: str | None) -> Response:
    """Lead a browser on that has come in already, by this token or by one like it.

    A token of nobody counts as a guess; the guard refuses an address that has brought too many.

    Raises:
        UsedUpError: it has not come in.
    """
    door = _door(request)
    who = sessions.same_as(db, token, request.cookies.get(door.cookie, ""), door.idle)
    if who is not None:
        return redirect(to or home_of(who))
    door.guesses.wrong(request.client.host if request.client else "")
    request.state.back = to or "/"  # of two presses at once, the other one may have let it in
    raise UsedUpError


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
