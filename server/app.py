"""The web application: API, pages, static files. It never loads torch; the worker is another process."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import structlog
from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, JSONResponse
from fastapi.staticfiles import StaticFiles
from starlette.exceptions import HTTPException

import server.api
import server.pages
from server.db import Database, connect
from server.deps import Db
from server.errors import (
    Busy,
    Invalid,
    MethodNotAllowed,
    NotFound,
    NotReady,
    ServerError,
    SetupError,
    TooLarge,
)
from server.guard import Guard
from server.schema import require
from server.settings import Settings
from server.starting import messages
from server.streams import Streams
from server.wake import Bell
from server.workers import alive

STATIC = Path(__file__).parents[1] / "web" / "static"
LARGEST_BODY = 64 * 1024
WEEK = 7 * 24 * 3600

log = structlog.get_logger()


def create_app(settings: Settings, db: Database | None = None) -> FastAPI:
    """The application on a migrated database (`db` instead of the settings' own: for tests).

    Raises:
        SetupError: the database cannot be used as it is; the sentence names the remedy.
    """
    db = connect(settings) if db is None else db
    require(db)
    app = FastAPI(
        title="Parenting",
        openapi_url="/api/v1/openapi.json",
        docs_url=None,  # FastAPI's own pages load from another origin
        redoc_url=None,
        lifespan=_lifespan,
    )
    app.state.db, app.state.settings = db, settings
    app.state.worker_bell = Bell(settings.data, "worker")
    app.state.streams = Streams(db, Bell(settings.data, "web"), settings.streams)
    app.add_middleware(Guard, largest_body=LARGEST_BODY)
    _add_errors(app)
    _add_health(app)
    app.include_router(server.api.router)
    app.include_router(server.pages.router)
    _add_static(app)
    return app


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    app.state.streams.open()
    yield
    app.state.streams.end()
    app.state.db.close()


def _add_errors(app: FastAPI) -> None:
    """One shape for every error; below /api it is JSON, elsewhere a page says the same."""

    @app.exception_handler(ServerError)
    def refused(request: Request, error: ServerError) -> Response:
        if error.status >= 500:
            log.warning("refused", path=request.url.path, code=error.code)
        headers = {"Retry-After": "1"} if isinstance(error, Busy) else None
        return _reply(request, error, headers)

    @app.exception_handler(RequestValidationError)
    def malformed(request: Request, error: RequestValidationError) -> Response:
        return _reply(request, Invalid(messages(error.errors(), skip=("body", "path", "query", "header"))))

    @app.exception_handler(HTTPException)
    def http(request: Request, error: HTTPException) -> Response:
        kinds: dict[int, type[ServerError]] = {404: NotFound, 405: MethodNotAllowed, 413: TooLarge}
        known = kinds.get(error.status_code)
        said = known() if known is not None else ServerError(str(error.detail))
        if known is None:
            said.status, said.code = error.status_code, "refused"
        return _reply(request, said, dict(error.headers or {}))


def _reply(request: Request, error: ServerError, headers: dict[str, str] | None = None) -> Response:
    programs = ("/api/", "/static/", "/healthz", "/readyz")
    if request.url.path.startswith(programs):
        return JSONResponse(error.body(), error.status, headers)
    page = server.pages.error_page(request, error)
    page.headers.update(headers or {})
    return page


def _add_health(app: FastAPI) -> None:
    @app.get("/healthz", tags=["health"])
    def healthz() -> dict[str, str]:
        """This process answers."""
        return {"status": "ok"}

    @app.get("/readyz", tags=["health"])
    def readyz(db: Db) -> dict[str, Any]:
        """The database answers, its tables are up to date, and a worker gives signs of life; else 503."""
        try:
            require(db)
        except SetupError as error:
            raise NotReady(error.message) from None
        if not alive(db):
            raise NotReady("No worker gives a sign of life. Start one: parenting worker")
        return {"status": "ok", "database": "ok", "migrations": "ok", "worker": "ok"}


def _add_static(app: FastAPI) -> None:
    plotly = find_spec("plotly")  # found, not imported: it takes a second
    folders = [] if plotly is None else plotly.submodule_search_locations or []
    script = next(
        (path for folder in folders if (path := Path(folder, "package_data/plotly.min.js")).is_file()), None
    )

    @app.get("/static/vendor/plotly.min.js", include_in_schema=False)
    def plotly_script() -> FileResponse:
        if script is None:
            raise NotFound("The charts' library is not installed. Run: pip install plotly")
        return FileResponse(
            script, media_type="text/javascript", headers={"Cache-Control": f"public, max-age={WEEK}"}
        )

    app.mount("/static", StaticFiles(directory=STATIC), name="static")
