"""The answers of a run as JSON lines: the question, the choice, who answered and when, and the policy.

Each answer is a line, with the same keys in every line, so that other programs read the file as a table (for
example `datasets.load_dataset("json", data_files="run-1.jsonl")`). A superseded answer keeps its own line.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import datetime
from typing import Any

from parenting.server.db import Database
from parenting.server.reads.answers import Answered, every, number_of
from parenting.server.runs import get_run
from parenting.server.tables import Run

MU = {"left": [1.0, 0.0], "right": [0.0, 1.0], "either": [0.5, 0.5], "neither": None}
"""Eq. (1); *neither* trains nothing."""


def rows(db: Database, run_id: int) -> Iterator[dict[str, Any]]:
    """Return the answers of a run up to now, oldest first, read in batches.

    Raises:
        NotFound: the run does not exist; raised here, not at the first row.
    """
    run = get_run(db, run_id)
    return (_row(db, run, answered) for answered in every(db, run_id))


def lines(db: Database, run_id: int) -> Iterator[str]:
    """Return the answers as JSON in ASCII, one line each.

    Raises:
        NotFound: the run does not exist; raised here, not at the first line.
    """
    return (json.dumps(row, separators=(",", ":")) + "\n" for row in rows(db, run_id))


def _row(db: Database, run: Run, answered: Answered) -> dict[str, Any]:
    answer, query = answered.answer, answered.query
    return {
        "run": run.id,
        "number": answer.number,
        "query": query.id,
        "world": run.world,
        "level": run.level,
        "kind": query.kind,
        "maturity": query.maturity,
        "tick": query.tick,  # at which it was asked
        "applied_tick": answer.applied_tick,  # at which the agent heard the answer; null: not yet
        "policy": {"stage": query.policy_stage, "gradient_steps": query.policy_steps},
        "left": query.clips["left"],
        "right": query.clips["right"],
        "choice": answer.choice,
        "mu": MU[answer.choice],
        "parent": answer.parent,
        "asked": _time(query.posted),
        "received": _time(answer.received),
        "standing": answer.standing,
        "supersedes": None if answer.supersedes is None else number_of(db, answer.supersedes),
    }


def _time(moment: datetime) -> str:
    """Format a time as ISO 8601 in UTC, always of the same length, so that it sorts as text."""
    return moment.replace(tzinfo=None).isoformat(timespec="microseconds") + "Z"
