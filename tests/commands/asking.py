"""Runs for a script to answer, and questions without an agent behind them."""

from __future__ import annotations

from typing import Any

from parenting.server import runs
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue.worker_side import post_query
from tests.server.conftest import CLIPS


def begin(db: Database, world: str = "unsafe-exploration", **fields: Any) -> int:
    config = {"max_open_preferences": 0, **fields.pop("config", {})}
    return start(db, NewRun(world=world, config=config, **fields)).id


def asked(db: Database, run: int, *ticks: int, kind: str = "guidance") -> list[int]:
    """Questions without an agent behind them."""
    (mine,) = runs.claim(db, "test", -1)
    assert mine.run_id == run
    return [post_query(db, mine, tick, kind, 1, CLIPS) for tick in ticks]
