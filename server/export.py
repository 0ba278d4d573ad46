"""The answers of a run as JSON lines: the question, the choice, who answered and when, and the policy.

Each answer and each skip is a line, with the same keys in every line, so that other programs read the file as
a table (for example `datasets.load_dataset("json", data_files="run-1.jsonl")`); only damaged and erased lines
have a key more. A superseded answer keeps its own line.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import datetime
from itertools import islice
from typing import Any

from parenting.server.damage import damage, sound
from parenting.server.db import Database
from parenting.server.identity import database_id
from parenting.server.reads.answers import BATCH, Answered, every, number_of
from parenting.server.reads.why import Kept, kept
from parenting.server.runs import stored_run
from parenting.server.tables import Run

MU = {
    "left": [1.0, 0.0],
    "right": [0.0, 1.0],
    "either": [0.5, 0.5],
    "neither": None,
    "skip": None,
}
"""Eq. (1); *neither* and *skip* train nothing."""


REASON = ("pausing", "familiarity", "p_guid", "chance", "p_pref", "draw", "probabilities", "clips")
"""The keys of a reason, for both kinds of questions; null where they are of the other kind."""


def rows(db: Database, run_id: int) -> Iterator[dict[str, Any]]:
    """Return the answers of a run up to now, oldest first, read in batches.

    A row that cannot be read stands there all the same: what is damaged is null, and `damaged` says so.

    Raises:
        NotFound: the run does not exist; raised here, not at the first row.
    """
    run, database = stored_run(db, run_id), database_id(db)
    return _rows(db, database, run)


def _rows(db: Database, database: str, run: Run) -> Iterator[dict[str, Any]]:
    answers = every(db, run.id)
    while batch := list(islice(answers, BATCH)):
        asked = [tick for one in batch if (tick := sound(one.query, "tick")) is not None]
        heard = [tick for one in batch if (tick := sound(one.answer, "applied_tick")) is not None]
        known = kept(db, run.id, asked, heard)
        for answered in batch:
            yield _row(db, database, run, answered) | _why(answered, known)


def _why(answered: Answered, known: Kept) -> dict[str, Any]:
    """Return the columns of `server.reads.why`: null where nothing was kept."""
    reason = known.reasons.get(sound(answered.query, "tick"))
    return {
        "leased": iso_time(sound(answered.query, "leased")),  # when its question was first leased
        "replays": sound(answered.answer, "replays"),  # how often its parent had the clips played again
        "reason": None if reason is None else {name: reason.get(name) for name in REASON},
        "effects": known.effects_of(sound(answered.answer, "applied_tick")),
    }


def lines(db: Database, run_id: int) -> Iterator[str]:
    """Return the answers as JSON in ASCII, one line each.

    Raises:
        NotFound: the run does not exist; raised here, not at the first line.
    """
    return (json.dumps(row, separators=(",", ":")) + "\n" for row in rows(db, run_id))


def _row(db: Database, database: str, run: Run, answered: Answered) -> dict[str, Any]:
    answer, query = answered.answer, answered.query
    world, level = sound(run, "world"), sound(run, "level")
    found = answered.damage or ("the run's world or level" if None in (world, level) else None)
    clips = query.clips if damage(query) is None else {"left": None, "right": None}
    choice, supersedes = sound(answer, "choice"), sound(answer, "supersedes")
    row = {
        "run": run.id,
        "number": sound(answer, "number"),
        "query": sound(answer, "query_id"),
        "world": world,
        "level": level,
        "kind": sound(query, "kind"),
        "maturity": sound(query, "maturity"),
        "tick": sound(query, "tick"),  # at which it was asked
        "applied_tick": sound(answer, "applied_tick"),  # at which the agent heard the answer; null: not yet
        "policy": {"stage": sound(query, "policy_stage"), "gradient_steps": sound(query, "policy_steps")},
        "left": clips["left"],
        "right": clips["right"],
        "choice": choice,
        "mu": None if choice is None else MU[choice],
        "parent": sound(answer, "parent"),
        "asked": iso_time(sound(query, "posted")),
        "received": iso_time(sound(answer, "received")),
        "standing": sound(answer, "standing"),
        "supersedes": None if supersedes is None else number_of(db, supersedes),
        "database": database,  # the names that mean the same everywhere
        "run_public_id": sound(run, "public_id"),
        "query_public_id": sound(query, "public_id"),
        "guidance_layout": sound(run, "guidance_layout"),  # the boards on which guidance was shown
        "practice": sound(run, "practice"),  # required: people practised before their first question
        "words": sound(run, "words"),  # guide: lengths of safe ways were told
        "remarks": sound(run, "remarks"),  # the page told of hasty and contradictory answers
        "votes": sound(query, "votes"),  # heard before on the same pair: above 0, it was asked again
        "script": sound(run, "script"),  # the errors of a scripted parent; null: people answer
    }
    if sound(answer, "erased") is not None:  # its person's data were deleted; other rows have no such key
        row["erased"] = True
    return row if found is None else {**row, "damaged": found}


def iso_time(moment: datetime | None) -> str | None:
    """Format a time as ISO 8601 in UTC, always of the same length, so that it sorts as text."""
    return None if moment is None else moment.replace(tzinfo=None).isoformat(timespec="microseconds") + "Z"
