"""The API under /api/v1: thin routes over `server.runs`, `server.queue` and `server.reads`."""

from __future__ import annotations

from fastapi import APIRouter

from parenting.server.api import (
    board,
    episodes,
    jobs,
    operator,
    page_errors,
    presence,
    queries,
    revisions,
    runs,
    streams,
)

router = APIRouter(prefix="/api/v1")
for part in (runs, episodes, board, operator, queries, presence, revisions, jobs, streams, page_errors):
    router.include_router(part.router)
