"""The dependencies of routes.

Pages and API write, for example:

    from parenting.server.deps import Db, SettingsOf

    @router.get("/runs/{run_id}")
    def page(request: Request, run_id: int, db: Db, settings: SettingsOf) -> Response: ...

`Db` is the `server.db.Database` that every verb of `server.runs` and `server.queue` takes first. Write
`def`, not `async def`: verbs block, so they belong in the thread pool, before which
`server.admission` lets requests wait (make routers by `admitted_router`). Raise `server.errors` freely:
`server.app` turns them into the one JSON shape for programs (/api, /static, /healthz, /readyz), and into the
pages' `error_page` elsewhere. After a stored answer or event call `notify_worker(request)`, so that the
worker acts on it at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, TypeVar

from fastapi import Depends, Request
from sqlalchemy.orm import Session

from parenting.server.admission import Admission
from parenting.server.db import Database
from parenting.server.group_commit import GroupCommit
from parenting.server.run_limits import StartedRuns
from parenting.server.settings import Settings
from parenting.server.tables import Run

Found = TypeVar("Found")


async def database(request: Request) -> Database:
    """Return the database of this application."""
    db: Database = request.app.state.db
    return db


async def settings_of(request: Request) -> Settings:
    """Return the settings that this application was made with."""
    settings: Settings = request.app.state.settings
    return settings


async def store(
    request: Request,
    verb: Callable[[Session], Found],
    durable: bool = True,
    worth: Callable[[Session], bool] | None = None,
) -> Found:
    """Call a verb in a transaction that writes, and return what it returned once that is committed.

    On SQLite many requests share a transaction (`server.group_commit`).

    Args:
        request: The request.
        verb: It writes by statements, not by changes of objects.
        durable: It is promised to somebody (`Database.write`).
        worth: Return whether there is anything to write; it is asked where no lock is needed otherwise. For
            verbs that may return None: where it is not worth it, the result is None.
    """
    state = request.app.state
    admission: Admission = state.admission
    group: GroupCommit | None = state.group_commit
    if group is None:
        found: Found = await admission.write(_alone, state.db, verb, durable, worth)
        return found
    return await group.store(verb, admission.seconds, durable, worth)


def _alone(
    db: Database, verb: Callable[[Session], Any], durable: bool, worth: Callable[[Session], bool] | None
) -> Any:
    if worth is not None:
        with db.read() as session:
            if not worth(session):
                return None
    with db.write(durable) as session:
        return verb(session)


def start_within_limits(request: Request, begin: Callable[[], Run]) -> Run:
    """Start a run if another one of this client may live (`server.run_limits`), and wake a worker.

    Args:
        request: The request, whose client has started it.
        begin: Starts it, if another one may live at all.

    Raises:
        TooManyRunsError: as many live as may, in all or of this client.
    """
    started: StartedRuns = request.app.state.started_runs
    db, client = request.app.state.db, request.client.host if request.client else ""
    with started.room(db, client) as begun:
        run = begin()
        begun.append(run.id)
    notify_worker(request)
    return run


def notify_worker(request: Request) -> None:
    """Wake the worker after a commit. This is a hint: a lost one costs the worker one poll."""
    request.app.state.worker_notifier.notify()


Db = Annotated[Database, Depends(database)]
SettingsOf = Annotated[Settings, Depends(settings_of)]
