"""The guard of every route: whoever calls it is known, and the matrix lets them, before anything is read."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute
from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from parenting.server.access.current import current
from parenting.server.access.door import Door
from parenting.server.access.matrix import Rule, rule_of
from parenting.server.access.roles import Principal
from parenting.server.audit.acting import acting
from parenting.server.db import Database
from parenting.server.errors import NotAllowedError, UnauthenticatedError
from parenting.server.public_ids import is_public_id
from parenting.server.route_names import route_of
from parenting.server.tables import Answer, Job, Query

ENTRANCE = "/open"
"""The address whose tokens are checked by the route itself."""
Handler = Callable[[Request], Coroutine[Any, Any, Response]]


class GuardedRoute(APIRoute):
    """A route that asks the matrix first. Its request has a `principal` from then on (`principal_of`)."""

    def get_route_handler(self) -> Handler:
        """Return the handler, behind the guard."""
        return self.guarded(self.get_handler())

    def get_handler(self) -> Handler:
        """Return the handler without the guard, for routes that put more between the two."""
        handle: Handler = super().get_route_handler()
        return handle

    def guarded(self, handle: Handler) -> Handler:
        """Return a handler behind the guard: nothing of a refused request is read."""

        async def guarded(request: Request) -> Response:
            await admit(request)
            return await handle(request)

        return guarded


async def admit(request: Request) -> None:
    """Let a request in, and note whose it is.

    Raises:
        UnauthenticatedError: nobody knows who it is from.
        NotAllowedError: the matrix does not let them.
        TooManyGuessesError: too many wrong secrets came from the same address.
        StoreError: the database cannot be read now.
    """
    rule = rule_of(request.method, route_of(request.scope))
    if rule is None:
        raise NotAllowedError
    door: Door = request.app.state.door
    if rule.roles is None:
        if route_of(request.scope) == ENTRANCE:
            door.guesses.require(request.client.host if request.client else "")
        return
    who = await door.principal(request)
    if who is None:
        raise UnauthenticatedError
    request.state.principal = who
    acting().who = who.who
    if who.role not in rule.roles:
        raise NotAllowedError
    if who.run is not None:
        await _require_within(request, rule, who)
    current.set(who)


def principal_of(request: Request) -> Principal:
    """Return whose a request is, behind the guard."""
    who: Principal = request.state.principal
    return who


async def _require_within(request: Request, rule: Rule, who: Principal) -> None:
    """Refuse what lies outside the run that somebody is confined to; it is not said whether it exists."""
    named = request.path_params
    if rule.where == "everything" or (rule.where == "run" and not who.reaches_run(named["run_id"])):
        raise NotAllowedError
    db, read = request.app.state.db, request.app.state.admission.read
    if rule.where == "question":
        await read(_require, db, is_own_question, who, named["query_id"])
    elif rule.where == "job":
        await read(_require, db, is_own_job, who, named["job_id"])


def require_own_question(request: Request, db: Database, name: str) -> None:
    """Refuse a question that was never offered to the caller, where they reach their own only. This reads.

    Raises:
        NotAllowedError: it is not theirs, or is not there.
    """
    who = principal_of(request)
    if who.run is not None:
        _require(db, is_own_question, who, name)


def _require(
    db: Database, is_own: Callable[[Session, Principal, str], bool], who: Principal, name: str
) -> None:
    with db.read() as session:
        if not is_own(session, who, name):
            raise NotAllowedError


def is_own_question(session: Session, who: Principal, name: str) -> bool:
    """Return whether a question is of the run that somebody is confined to, and was offered to them.

    A parent's own are those that it holds, held last, or answered.
    """
    if not is_public_id(name) and not (name.isascii() and name.isdecimal() and len(name) <= 16):
        return False
    named = Query.public_id == name if is_public_id(name) else Query.id == int(name)
    rows = select(Query.id).where(named, Query.run_id == who.run)
    if who.client is not None:
        answered = exists().where(Answer.query_id == Query.id, Answer.client_id == who.client)
        rows = rows.where((Query.leased_by == who.client) | answered)
    return session.execute(rows).first() is not None


def is_own_job(session: Session, who: Principal, name: str) -> bool:
    """Return whether a job is of the run that somebody is confined to, and asked for by them."""
    rows = select(Job.id).where(Job.public_id == name, Job.run_id == who.run)
    if who.client is not None:
        rows = rows.where(Job.client_id == who.client)
    return session.execute(rows).first() is not None
