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

from typing import Annotated

from fastapi import Depends, Request

from parenting.server.db import Database
from parenting.server.settings import Settings


async def database(request: Request) -> Database:
    """Return the database of this application."""
    db: Database = request.app.state.db
    return db


async def settings_of(request: Request) -> Settings:
    """Return the settings that this application was made with."""
    settings: Settings = request.app.state.settings
    return settings


def notify_worker(request: Request) -> None:
    """Wake the worker after a commit. This is a hint: a lost one costs the worker one poll."""
    request.app.state.worker_notifier.notify()


Db = Annotated[Database, Depends(database)]
SettingsOf = Annotated[Settings, Depends(settings_of)]
