"""The web application: API, pages, static files. It never loads torch; the worker is another process."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache

import structlog
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.routing import APIRoute
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.routing import BaseRoute, Match
from starlette_compress import CompressMiddleware, remove_compress_type

from parenting.drawing.sentences import mark
from parenting.server import api, health, pages
from parenting.server.access.door import Door
from parenting.server.access.key import make_key
from parenting.server.admission import Admission
from parenting.server.api.openapi import Described
from parenting.server.audit.acting import acting
from parenting.server.audit.refusals import Refusals
from parenting.server.db import Database, connect
from parenting.server.entrance import Entrance
from parenting.server.errors import (
    InvalidFieldsError,
    MethodNotAllowed,
    NotFound,
    ServerError,
    StoreError,
    TooLargeError,
    TooManyGuessesError,
    UnauthenticatedError,
)
from parenting.server.group_commit import GroupCommit
from parenting.server.inherited import POLICY_BYTES
from parenting.server.job_kinds import KINDS
from parenting.server.languages import SHIPPED, LanguageMiddleware, Languages
from parenting.server.log_limit import LogLimit
from parenting.server.meters import Meters
from parenting.server.migrate import require_ready
from parenting.server.notify import Notifier
from parenting.server.pages.render import compile_first
from parenting.server.requests import RequestMiddleware
from parenting.server.run_limits import StartedRuns
from parenting.server.seats import Seats
from parenting.server.security import SecurityMiddleware
from parenting.server.settings import Settings
from parenting.server.static import OthersFiles, OurFiles
from parenting.server.store.patience import patience
from parenting.server.streams import Streams
from parenting.server.strict import TwiceError
from parenting.server.wrong_fields import messages

LARGEST_BODY = 64 * 1024
LARGER_BODIES = {"/api/v1/policies": POLICY_BYTES, "/policies": POLICY_BYTES + LARGEST_BODY}
END_SECONDS = 1.0
"""Seconds that the last write may wait for the store: a process that is told to end does so within five."""
SMALL_BODY = 1024
"""Bytes below which a reply is sent as it is: it fits into one packet, compressed or not."""
METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE")
ABOUT = """Start a run, lease its questions, answer them, watch how the agent learns, export what was said.

Bodies are JSON and strict: an unknown field is refused. Every error has one shape. Lists come in pages, and
what a page says under *next* is the cursor of the following one. No GET changes anything; an export is
entered in the audit log."""
TAGS = [
    {"name": "runs", "description": "Start them, look at them, read what they did."},
    {"name": "operator", "description": "What whoever runs the experiment may do to a living agent."},
    {"name": "questions", "description": "What the agent asks its parent, and the parent's answers."},
    {"name": "jobs", "description": "What a page asks of any worker, apart from the agent's life."},
    {"name": "pages", "description": "What our own pages tell of themselves."},
    {"name": "health", "description": "For whoever watches over the processes."},
]

REFUSED = (
    "unknown_host",
    "plain_http",
    "forwarded",
    "cross_site",
    "unauthenticated",
    "not_allowed",
    "guessing",
    "used_up",
)
"""Codes of errors that the audit log tells of."""

log = structlog.get_logger()


def create_app(settings: Settings, db: Database | None = None) -> FastAPI:
    """Make the application on a migrated database.

    Args:
        settings: The settings of the web process.
        db: Another database than the settings' own, for tests.

    Raises:
        SetupError: the database cannot be used as it is; the sentence names the remedy.
    """
    db = connect(settings) if db is None else db
    require_ready(db)
    app = bare_app()
    app.state.refusals = Refusals(db)
    app.state.db, app.state.settings, app.state.entrance = db, settings, Entrance.of(settings)
    app.state.languages = Languages(settings.languages or SHIPPED)
    app.state.worker_notifier = Notifier(settings.data, "worker")
    app.state.started_runs = StartedRuns(settings.runs_per_client)
    app.state.admission, app.state.health_threads = Admission(), health.health_threads()
    app.state.group_commit = GroupCommit(db) if db.one_writer else None
    notifier = Notifier(settings.data, "web")
    app.state.door = Door(db, make_key(settings.data), settings.session_days, settings.session_idle_days)
    app.state.seats = Seats(settings.streams_per_browser, settings.streams_per_client)
    app.state.streams = Streams(db, notifier, settings.streams, app.state.admission)
    app.state.meters.watch(db, app.state.streams.number, lambda: app.state.admission)
    return app


def bare_app() -> FastAPI:
    """Make the routes alone, without a database: enough to describe the API."""
    app = Described(
        title="Parenting",
        version="1",
        description=ABOUT,
        openapi_tags=TAGS,
        openapi_url="/api/v1/openapi.json",
        generate_unique_id_function=_route_name,
        docs_url=None,  # FastAPI's own pages load from another origin; ours is server.pages.docs
        redoc_url=None,
        lifespan=_lifespan,
    )
    remove_compress_type("text/event-stream")  # each event leaves at once, as it is
    app.add_middleware(
        CompressMiddleware, minimum_size=SMALL_BODY, zstd=False, brotli_quality=5, gzip_level=6
    )
    app.state.entrance = Entrance()
    app.add_middleware(SecurityMiddleware, largest_body=LARGEST_BODY, reply=_reply, larger=LARGER_BODIES)
    app.state.languages = Languages()
    app.add_middleware(LanguageMiddleware)
    app.state.meters, app.state.page_errors = Meters(), LogLimit()
    app.add_middleware(
        RequestMiddleware, meters=app.state.meters
    )  # the outermost: refused requests count, too
    _add_errors(app)
    app.router.routes += _routes()
    app.mount("/static/vendor", OthersFiles())
    app.mount("/static", OurFiles(), name="static")
    return app


@cache
def _routes() -> list[BaseRoute]:
    """Return the routes of health, API and pages.

    All applications of a process share them: the framework works out what a route needs at its first request.
    """
    holder = FastAPI(openapi_url=None, generate_unique_id_function=_route_name)
    for router in (health.router, api.router, pages.router):
        holder.include_router(router)
    return list(holder.routes)


def _route_name(route: APIRoute) -> str:
    return route.name


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    _warm(app)
    app.state.streams.open()
    writing = asyncio.create_task(app.state.refusals.keep_writing())
    yield
    writing.cancel()
    with patience(END_SECONDS):
        await run_in_threadpool(app.state.refusals.write)
    app.state.streams.end()
    if app.state.group_commit is not None:
        app.state.group_commit.close()
    app.state.db.close()


def _warm(app: FastAPI) -> None:
    """Do before anybody is served what the first requests would else wait for.

    The framework works out what a route needs when an address is first held against it, and templates are
    compiled when they are first used. On a busy machine the first page took seconds.
    """
    nowhere = {"type": "http", "method": "GET", "path": "/-", "root_path": "", "headers": []}
    for route in app.router.routes:
        route.matches(nowhere)
    compile_first()


def _add_errors(app: FastAPI) -> None:
    """Give every error one shape: JSON below /api, a page elsewhere.

    Handlers are coroutines, or each would need a thread, and threads may be what is lacking.
    """
    limit = LogLimit()

    @app.exception_handler(ServerError)
    async def refused(request: Request, error: ServerError) -> Response:
        if error.status >= 500:
            why = {"why": error.message} if isinstance(error, StoreError) else {}
            limit.say(error.code, log.warning, "refused", path=request.url.path, code=error.code, **why)
            request.app.state.meters.refuse(error.code)
        headers = {"Retry-After": "1"} if isinstance(error, StoreError) else None
        if isinstance(error, TooManyGuessesError):
            headers = {"Retry-After": str(error.seconds)}
        if isinstance(error, UnauthenticatedError):
            headers = {"WWW-Authenticate": "Bearer"}
        return _reply(request, error, headers)

    @app.exception_handler(RequestValidationError)
    async def malformed(request: Request, error: RequestValidationError) -> Response:
        of_run = any(tuple(one["loc"]) == ("path", "run_id") for one in error.errors())
        if of_run and not request.url.path.startswith("/api/"):
            return _reply(
                request, NotFound(mark("There is no run '{run}'."), run=request.path_params["run_id"])
            )
        skip = ("body", "path", "query", "header", *KINDS)  # a union's error names the kind that was tried
        return _reply(request, InvalidFieldsError(messages(error.errors(), skip)))

    @app.exception_handler(HTTPException)
    async def http(request: Request, error: HTTPException) -> Response:
        headers = dict(error.headers or {})
        if error.status_code == 405 and "route" in request.scope:
            headers["Allow"] = _allowed(request)
        return _reply(request, _said(error), headers)


def _said(error: HTTPException) -> ServerError:
    """Return our error for one of the framework's."""
    kinds: dict[int, type[ServerError]] = {404: NotFound, 405: MethodNotAllowed}
    if error.status_code == 400:  # a body that is not text, or not a form
        return InvalidFieldsError([("body", "It cannot be read. Send JSON in UTF-8, or a form.")])
    if isinstance(error, TwiceError):
        return error.said
    if error.status_code == 413:  # `server.security` tells the limit
        return TooLargeError(most=error.detail)
    if error.status_code in kinds:
        return kinds[error.status_code]()
    said = ServerError(str(error.detail))
    said.status, said.code = error.status_code, "refused"
    return said


def _allowed(request: Request) -> str:
    """Return the methods of all routes of an address; the framework names those of one route only."""
    scopes = ((method, {**request.scope, "method": method}) for method in METHODS)
    return ", ".join(
        method
        for method, scope in scopes
        if any(route.matches(scope)[0] is Match.FULL for route in request.app.routes)
    )


def _reply(request: Request, error: ServerError, headers: dict[str, str] | None = None) -> Response:
    if error.code in REFUSED and hasattr(request.app.state, "refusals"):
        actor = acting()
        request.app.state.refusals.note(error.code, actor.who, actor.client or "")
    programs = ("/api/", "/static/", "/healthz", "/readyz", "/metrics")
    if request.url.path.startswith(programs):
        return JSONResponse(error.body(), error.status, headers)
    page = pages.error_page(request, error)
    page.headers.update(headers or {})
    return page
