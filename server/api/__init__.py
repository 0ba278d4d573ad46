"""The API under /api/v1: thin routes over `server.runs`, `server.queue` and `server.reads`."""

from __future__ import annotations

from fastapi import APIRouter

from parenting.server.api import (
    audit,
    board,
    episodes,
    jobs,
    keeping,
    levels,
    operator,
    page_errors,
    policies,
    presence,
    queries,
    revisions,
    runs,
    streams,
)

router = APIRouter(prefix="/api/v1")
PARTS = (
    queries,  # first, as a request is compared with one route after the other, and most of them come here
    runs,
    policies,
    keeping,
    episodes,
    board,
    operator,
    audit,
    presence,
    revisions,
    jobs,
    levels,
    streams,
    page_errors,
)
for part in PARTS:
    router.include_router(part.router)
