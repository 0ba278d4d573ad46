"""The page of links and tokens: who may come in, a form that makes one, and a button that ends each."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import timedelta
from typing import Annotated, NamedTuple

from fastapi import Path, Query, Request, Response

from parenting.envs.people_text import read_name
from parenting.server.access import tokens
from parenting.server.access.door import Door
from parenting.server.access.guard import principal_of
from parenting.server.access.roles import Role
from parenting.server.access.tokens import MOST_DAYS, Made, TokenKind
from parenting.server.admission import admitted_router
from parenting.server.api.names import PublicId
from parenting.server.api.names import read_name as read_run
from parenting.server.db import Database
from parenting.server.deps import Db, SettingsOf
from parenting.server.errors import InvalidFieldsError, NotFound
from parenting.server.pages.render import page, redirect
from parenting.server.pages.start import FormFields
from parenting.server.reads.access import listing
from parenting.server.reads.names import run_number

router = admitted_router(include_in_schema=False)


class Wish(NamedTuple):
    """One line of the form's choice: what is made, for which role."""

    kind: TokenKind
    role: Role
    text: str


WISHES = {
    "parent": Wish("link", Role.PARENT, "A parent, by a link"),
    "viewer": Wish("link", Role.VIEWER, "Somebody who only looks, by a link"),
    "scrape": Wish("program", Role.VIEWER, "A program that only looks, by a token"),
    "script": Wish("program", Role.PARENT, "A program that answers, by a token"),
    "program": Wish("program", Role.RESEARCHER, "A program that may do everything, by a token"),
}
EMPTY = {"wish": "parent", "run": "", "name": "", "days": ""}
NO_RUN = "There is no such run. The list of runs shows their numbers."
Ask = Annotated[str, Query(max_length=40)]


@router.get("/access")
def access_page(request: Request, db: Db, settings: SettingsOf, run: Ask = "") -> Response:
    """Show who may come in, and an empty form; `run` fills in the run."""
    return _page(request, db, settings.session_idle_days, {**EMPTY, "run": run})


@router.post("/access/create")
def create(request: Request, db: Db, settings: SettingsOf, form: FormFields) -> Response:
    """Make a link or a token and show it once, or show the form again with an error next to a wrong field."""
    given = {**EMPTY, **{name: form[name].strip() for name in EMPTY if name in form}}
    try:
        made = _make(db, given, principal_of(request).who)
    except InvalidFieldsError as error:
        return _page(request, db, settings.session_idle_days, given, dict(error.fields))
    return _page(request, db, settings.session_idle_days, EMPTY, made=made)


@router.post("/access/{access_id}/revoke")
def revoke(request: Request, db: Db, access_id: Annotated[PublicId, Path()]) -> Response:
    """End a link, a token or a session, and whoever came in by it."""
    tokens.revoke(db, access_id)
    door: Door = request.app.state.door
    door.forget()
    return redirect("/access")


def _make(db: Database, form: Mapping[str, str], who: str) -> Made:
    """Make what a form asks for.

    Raises:
        InvalidFieldsError: names every wrong field, with a message each.
    """
    errors: dict[str, str] = {}
    wish = WISHES.get(form["wish"])
    if wish is None:
        errors["wish"] = "Choose one of the list."
    run, days, name = _run(db, form["run"], errors), _days(form["days"], errors), _name(form["name"], errors)
    if wish is not None and wish.role is Role.PARENT and not form["run"]:
        errors["run"] = "Name the run that the parent answers."
    if errors or wish is None:
        raise InvalidFieldsError(list(errors.items()))
    return tokens.make(db, wish.kind, wish.role, run=run, name=name, days=days, made_by=who)


def _run(db: Database, text: str, errors: dict[str, str]) -> int | None:
    if not text:
        return None
    try:
        number = run_number(db, read_run(text))
        tokens.require_run(db, number)
    except ValueError as error:
        errors["run"] = f"{str(error)[:1].upper()}{str(error)[1:]}."
    except NotFound:
        errors["run"] = NO_RUN
    else:
        return number
    return None


def _days(text: str, errors: dict[str, str]) -> float | None:
    if not text:
        return None
    try:
        days = float(text)
    except ValueError:
        days = 0.0
    if not 0 < days <= MOST_DAYS:
        errors["days"] = f"Write a number above 0 and up to {MOST_DAYS:g}."
    return days


def _name(text: str, errors: dict[str, str]) -> str | None:
    try:
        return read_name(text) if text else None
    except ValueError as error:
        errors["name"] = f"{str(error)[:1].upper()}{str(error)[1:]}."
    return None


def _page(
    request: Request,
    db: Database,
    idle_days: float,
    form: Mapping[str, str],
    errors: Mapping[str, str] | None = None,
    made: Made | None = None,
) -> Response:
    lists = listing(db, timedelta(days=idle_days))
    return page(
        "access.html",
        422 if errors else 200,
        lists=vars(lists),
        form=form,
        errors=errors or {},
        focus=next(iter(errors or {}), None),
        wishes=WISHES,
        days=tokens.DAYS,
        own=principal_of(request).id,
        made=None if made is None else _shown(request, made),
    )


def _shown(request: Request, made: Made) -> dict[str, object]:
    """Return what the page shows once. The host is a name of this server: `server.entrance` has asked."""
    link = made.token.kind == "link"
    here = f"{request.scope['scheme']}://{request.headers['host']}"
    secret = f"{here}/open?token={made.secret}" if link else made.secret
    return {"secret": secret, "link": link, "role": made.token.role, "expires": made.token.expires}
