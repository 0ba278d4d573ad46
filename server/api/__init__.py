"""The API under /api/v1: thin routes over the verbs of `server.runs`, `queue` and `record`."""

from __future__ import annotations

from fastapi import APIRouter

from server.api import queries, runs, streams

router = APIRouter(prefix="/api/v1")
for part in (runs, queries, streams):
    router.include_router(part.router)
