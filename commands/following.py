"""A thread of `parenting up` that reads how its workers are, and says how many there should be."""

from __future__ import annotations

import threading
import time

import structlog

from parenting.commands.crew import Crew
from parenting.commands.sizing import Sizing
from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.errors import StoreError
from parenting.server.workers import Figures, is_here, living

log = structlog.get_logger()

LOOK_SECONDS = 1.0
"""Seconds between two looks at what the workers say of themselves."""


def follow_load(crew: Crew, db: Database, sizing: Sizing, told: threading.Event) -> None:
    """Keep the number of workers at what their load asks for, until told to stop; runs in a thread.

    Args:
        crew: The workers.
        db: The database in which they say how they are.
        sizing: The rule.
        told: Ends it.
    """
    while not told.wait(LOOK_SECONDS):
        try:
            crew.wanted = sizing.look(_said(crew, db), time.monotonic())
        except StoreError:
            continue  # it can say nothing now: their number stays
        except Exception:
            log.exception("the load of the workers could not be read; their number stays")


def _said(crew: Crew, db: Database) -> list[Figures]:
    """Return what the workers of this crew say of themselves."""
    mine = [child.process.pid for child in list(crew.children)]
    rows = [row for row in living(db) if any(is_here(row.name, pid) for pid in mine)]
    return [Figures(*(sound(row, name) for name in Figures._fields)) for row in rows]
