"""Operator events are kept in their order, and a run that is over takes none."""

import pytest

from parenting.server.db import Database
from parenting.server.errors import Conflict, NotFound
from parenting.server.operator_events import add_operator_event, list_operator_events
from parenting.server.runs import set_status
from parenting.server.statuses import RunStatus
from parenting.server.tables import Run


def test_events_are_kept_in_order(db: Database, run: Run) -> None:
    add_operator_event(db, run.id, "mature", {"kind": "mature"})
    add_operator_event(db, run.id, "end_episode", {"kind": "end_episode"})
    assert [(event.kind, event.applied_tick) for event in list_operator_events(db, run.id)] == [
        ("mature", None),
        ("end_episode", None),
    ]


def test_nothing_happens_to_a_run_that_is_over(db: Database, run: Run) -> None:
    set_status(db, run.id, RunStatus.STOPPED)
    with pytest.raises(Conflict, match="is stopped"):
        add_operator_event(db, run.id, "mature", {})
    with pytest.raises(NotFound):
        add_operator_event(db, 99, "mature", {})
