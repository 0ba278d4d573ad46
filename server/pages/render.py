"""Render templates to pages. Text is escaped everywhere; nothing a person wrote is ever marked safe."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from jinja2.meta import find_referenced_templates
from markupsafe import Markup
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response

from parenting.drawing.render import environment
from parenting.drawing.sentences import tr, trn
from parenting.envs.people_text import isolated
from parenting.server.access.current import home
from parenting.server.access.matrix import may
from parenting.server.access.roles import Principal, Role
from parenting.server.assets import asset
from parenting.server.errors import ServerError, StoreError
from parenting.server.languages import language
from parenting.server.pages.numbers import number
from parenting.server.pages.texts import world_title
from parenting.server.public_ids import ALPHABET, LENGTH
from parenting.server.tables import Run

FIRST = ("start.html", "dashboard.html", "parent.html")
"""The pages that people open first. No request for one of them waits until it is compiled."""
YEAR = 365 * 24 * 3600
"""Seconds for which a browser keeps our cookies."""
REFUSED = ("unauthenticated", "used_up", "not_allowed", "guessing")
"""Codes of errors about who somebody is; they have a page that says how to come in."""
WEB = Path(__file__).parent.parent.parent / "web"


def tr_markup(sentence: str, **values: object) -> Markup:
    """Return a sentence that holds tags of its own; what is put into it is escaped."""
    return Markup(tr(sentence)).format(**values)  # a sentence of the catalogue, without values


_templates = environment(WEB / "templates")
_templates.filters.update(isolated=isolated, number=number, world_title=world_title)
_templates.globals.update(asset=asset, language=language, home=home, may=may, _=tr, _n=trn, _h=tr_markup)


def page(template: str, status: int = 200, **context: object) -> HTMLResponse:
    """A page, or a part of one. It is not stored by the browser: it shows what is true now."""
    return HTMLResponse(
        render(template, **context), status_code=status, headers={"Cache-Control": "no-store"}
    )


def render(template: str, **context: object) -> str:
    """A template's text."""
    return _templates.get_template(template).render(**context)


@cache
def compile_first() -> None:
    """Compile the templates that `FIRST` names, with the parts that they hold: once a process."""
    known: set[str] = set()
    names = [*FIRST]
    while names:
        name = names.pop()
        known.add(name)
        source = _templates.get_template(name).filename
        parts = find_referenced_templates(_templates.parse(Path(str(source)).read_text("utf-8")))
        names += {part for part in parts if part} - known


def format_number(number: float | None) -> str:
    """A number as a field of a form shows it: whole, or "" for none. It reads back as the same number."""
    return "" if number is None else str(number).removesuffix(".0")


def moved(request: Request, run: Run) -> RedirectResponse | None:
    """Return the way to a run's page by its public id, where the address names the run by its number.

    Numbers are the researcher's short names; whoever opens a page of a run meets its public id alone.
    """
    if request.path_params["run_id"] == run.public_id:
        return None
    page_of_run = request.url.path.split("/", 3)[3:]
    query = f"?{request.url.query}" if request.url.query else ""
    return redirect("/".join((f"/runs/{run.public_id}", *page_of_run)) + query, status=307)


def redirect(path: str, status: int = 303) -> RedirectResponse:
    """After a POST: look there (303), so that a reload repeats nothing. 307: an old address of a page."""
    return RedirectResponse(path, status_code=status)


def remember(request: Request, response: Response, name: str, value: str) -> None:
    """Set a cookie for a year that no script reads, and that leaves over https only if it came so."""
    secure = request.scope["scheme"] == "https"
    response.set_cookie(name, value, max_age=YEAR, secure=secure, httponly=True, samesite="lax")


def _way_back(request: Request) -> str | None:
    """Return the page where somebody who is known has their work; None for a stranger."""
    who: Principal | None = getattr(request.state, "principal", None)
    if who is None or (who.run is not None and who.run_public_id is None):
        return None
    run = "/" if who.run is None else f"/runs/{who.run_public_id}"
    return f"{run}/parent" if who.role is Role.PARENT and who.run is not None else run


def error_page(request: Request, error: ServerError) -> HTMLResponse:
    """An error as a page: what happened, in a sentence, and the way back.

    What a run refused leads back to it, and what the store refused to the same page, or to the page of the
    form that was sent; else there may be no such run.
    """
    if error.code in REFUSED:
        back = getattr(request.state, "back", None) or _way_back(request)
        return page("refused.html", error.status, code=error.code, back=back)
    run = re.match(rf"/runs/([{ALPHABET}]{{{LENGTH}}}|[1-9][0-9]*)(?![^/])(/parent)?", request.url.path)
    refused = isinstance(error, StoreError)
    back = run[0] if run and (error.status == 409 or refused) else "/"
    again = refused and request.method == "GET"
    if again:
        back = request.url.path + (f"?{request.url.query}" if request.url.query else "")
    return page("error.html", error.status, message=error.told, back=back, again=again)
