"""Health, for whoever watches over the processes: /healthz, /readyz and /metrics, without the pages' threads.

`/healthz` is answered in the event loop. `/readyz` asks the store in a thread of its own and answers within a
second, also where that thread hangs: a watchdog must not mistake a locked database for a dead process.
"""

from __future__ import annotations

from functools import partial

from anyio import CapacityLimiter, move_on_after, to_thread
from fastapi import APIRouter, Request, Response

from parenting.server.access.guard import GuardedRoute
from parenting.server.api.responses import error_responses
from parenting.server.db import Database
from parenting.server.errors import BusyError, NotReadyError, SetupError, StoreError
from parenting.server.meters import TYPE
from parenting.server.migrate import require_current
from parenting.server.store.patience import patience
from parenting.server.workers import alive

router = APIRouter(tags=["health"], route_class=GuardedRoute)

SECONDS = 0.8
"""The store's time to answer; the reply is out within a second."""
THREADS = 2
READY = {"status": "ok", "database": "ok", "migrations": "ok", "worker": "ok"}
ERRORS = (400, 413, 500)


@router.get("/healthz", summary="Ask for life", responses=error_responses(*ERRORS))
async def healthz() -> dict[str, str]:
    """Say that this process answers."""
    return {"status": "ok"}


@router.get("/readyz", summary="Ask for readiness", responses=error_responses(*ERRORS, 503))
async def readyz(request: Request) -> dict[str, str]:
    """Check that the database answers, its tables are up to date, and a worker is alive; else 503.

    The message begins with `store: busy`, `store: disk_full` or another code where the database refuses.
    """
    limiter = request.app.state.health_threads
    with move_on_after(SECONDS):
        look = partial(_look, request.app.state.db)
        return await to_thread.run_sync(look, abandon_on_cancel=True, limiter=limiter)
    raise _refused(BusyError())


@router.get("/metrics", include_in_schema=False)
async def metrics(request: Request) -> Response:
    """Return figures of this process and of the store in Prometheus' text format."""
    state = request.app.state
    text = await to_thread.run_sync(state.meters.text, limiter=state.health_threads)
    return Response(text, media_type=TYPE)


def health_threads() -> CapacityLimiter:
    """Return the threads of /readyz, apart from those of the pages."""
    return CapacityLimiter(THREADS)


def _look(db: Database) -> dict[str, str]:
    try:
        with patience(SECONDS / 2):
            require_current(db)
            refused = db.refusal()
            if refused is not None:
                raise refused
            if not alive(db):
                raise NotReadyError("No worker gives a sign of life. Start one: `parenting worker`")
    except SetupError as error:
        raise NotReadyError(error.message) from None
    except StoreError as error:
        raise _refused(error) from None
    return READY


def _refused(error: StoreError) -> NotReadyError:
    return NotReadyError(f"store: {error.code}. {error.sentence}")  # `message` may name what is not for all
