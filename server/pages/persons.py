"""The pages of the people who answered: their pseudonyms, and the deletion of one's data."""

from __future__ import annotations

from typing import Annotated

from fastapi import Form, Path, Request, Response

from parenting.server import erasure
from parenting.server.admission import admitted_router
from parenting.server.deps import Db, notify_worker
from parenting.server.errors import Conflict
from parenting.server.pages.render import page, redirect
from parenting.server.reads.persons import persons

router = admitted_router(include_in_schema=False)

Pseudonym = Annotated[str, Path(pattern=r"^p[0-9a-z]{9}$")]


@router.get("/persons")
def persons_page(db: Db) -> Response:
    """List who answered."""
    return page("persons.html", people=persons(db))


@router.get("/persons/{pseudonym}/delete")
def delete_page(pseudonym: Pseudonym, db: Db) -> Response:
    """Ask before a person's data are deleted: the page says what goes and what stays."""
    return page("person_delete.html", plan=erasure.plan(db, pseudonym))


@router.post("/persons/{pseudonym}/delete")
def delete(request: Request, pseudonym: Pseudonym, db: Db, confirm: Annotated[str, Form()]) -> Response:
    """Mark a person, whose data a worker then deletes, and go to the list."""
    if confirm != pseudonym:
        raise Conflict("This is another person than the page showed; nothing was deleted.")
    erasure.begin(db, pseudonym)
    notify_worker(request)
    return redirect("/persons")
