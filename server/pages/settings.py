"""The page of what is kept with a run (words, files, archive), and the page before its deletion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import Form, Request, Response
from pydantic import TypeAdapter, ValidationError

from parenting.server import deletion, keeping, runs
from parenting.server.admission import admitted_router
from parenting.server.api.bodies import Strict
from parenting.server.api.keeping import DELETE_SECONDS
from parenting.server.api.names import PublicId, RunId
from parenting.server.damage import damage
from parenting.server.db import Database
from parenting.server.deps import Db, notify_worker
from parenting.server.errors import Conflict, InvalidFieldsError
from parenting.server.keeping import LONGEST_DESCRIPTION, Description, Tag
from parenting.server.new_run import PersonsName
from parenting.server.pages.render import moved, page, redirect
from parenting.server.pages.start import FormFields
from parenting.server.pages.texts import parent_title
from parenting.server.sizes import size_text
from parenting.server.tables import Run
from parenting.server.wrong_fields import messages

router = admitted_router(include_in_schema=False)


class KeptWords(Strict):
    """The fields of the form."""

    name: PersonsName | None = None
    description: Description | None = None
    tags: list[Tag] | None = None


_WORDS = TypeAdapter(KeptWords)


@router.get("/runs/{run_id}/settings")
def settings_page(request: Request, run_id: RunId, db: Db) -> Response:
    """Show what is kept with a run."""
    run = runs.get_run(db, run_id)
    return moved(request, run) or _page(db, run, _typed(run), {})


@router.post("/runs/{run_id}/settings")
def set_words(request: Request, run_id: RunId, db: Db, form: FormFields) -> Response:
    """Keep other words, or show the form again with an error next to each wrong field."""
    run = runs.get_run(db, run_id)
    try:
        keeping.describe(db, run_id, _read(form))
    except InvalidFieldsError as error:
        return _page(db, run, {**_typed(run), **form}, dict(error.fields))
    return redirect(f"/runs/{request.path_params['run_id']}/settings")


@router.post("/runs/{run_id}/archive")
def set_archived(request: Request, run_id: RunId, db: Db, archived: Annotated[bool, Form()]) -> Response:
    """Leave a run out of the list, or take it in again."""
    keeping.archive(db, run_id, archived)
    return redirect(f"/runs/{request.path_params['run_id']}/settings")


@router.get("/runs/{run_id}/delete")
def delete_page(request: Request, run_id: RunId, db: Db) -> Response:
    """Ask before a run is deleted: the page says what it holds."""
    run = runs.stored_run(db, run_id)
    held = deletion.holds(db, run_id)
    name = deletion.name_of(db, run_id)
    return page(
        "delete.html", run_id=run_id, name=name, title=_title(run), held=held, size=size_text(held.bytes)
    )


@router.post("/runs/{run_id}/delete")
def delete(request: Request, run_id: RunId, db: Db, confirm: Annotated[PublicId, Form()]) -> Response:
    """Delete a run for good, and go to the list. A worker goes on with what is left of a large one."""
    if confirm != deletion.name_of(db, run_id):
        raise Conflict("This is another run than the page showed; nothing was deleted.")
    deletion.delete_run(db, run_id, DELETE_SECONDS)
    notify_worker(request)
    return redirect("/")


def _page(db: Database, run: Run, form: Mapping[str, str], errors: Mapping[str, str]) -> Response:
    context = {"run": run, "title": parent_title(run), "form": form, "errors": errors}
    held = deletion.holds(db, run.id)
    context |= {"held": held, "size": size_text(held.bytes), "known": keeping.known_tags(db)}
    context |= {"focus": next(iter(errors), None), "longest": LONGEST_DESCRIPTION}
    return page("settings.html", 422 if errors else 200, **context)


def _typed(run: Run) -> dict[str, str]:
    tags = ", ".join(keeping.split_tags(run.tags))
    return {"name": run.name or "", "description": run.description or "", "tags": tags}


def _read(form: Mapping[str, str]) -> dict[str, Any]:
    """Return what the form says; a field that it lacks stays as it is.

    Raises:
        InvalidFieldsError: names every wrong field, with a message each.
    """
    given: dict[str, Any] = {
        name: form[name].strip() or None for name in ("name", "description") if name in form
    }
    if "tags" in form:
        given["tags"] = [tag.strip() for tag in form["tags"].split(",") if tag.strip()]
    try:
        return _WORDS.validate_python(given).model_dump(include=set(given))
    except ValidationError as error:
        wrong = [(field.partition(".")[0], message) for field, message in messages(error.errors())]
        raise InvalidFieldsError(wrong) from None


def _title(run: Run) -> str:
    """Return the title of a run whose row may be damaged."""
    return f"Run {run.id}" if damage(run) else parent_title(run)
