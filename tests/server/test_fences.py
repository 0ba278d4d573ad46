"""Every write of a worker is fenced: with a stale token it is refused, and nothing of the store changes.

The first test reads the source: a function that writes is a worker's, which another test here tries with a
stale token, or it says why it needs none. So a new write cannot be forgotten.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from sqlalchemy import select

from parenting.server import jobs, runs
from parenting.server.board import store as board
from parenting.server.checkpoint_parts import sweep_parts, write_parts
from parenting.server.checkpoints import save_checkpoint
from parenting.server.db import Database
from parenting.server.errors import LostClaimError
from parenting.server.jobs import JobClaim
from parenting.server.machine import write as write_notes
from parenting.server.metrics import write_metrics
from parenting.server.moves import MovesWriter
from parenting.server.operator_events import add_operator_event
from parenting.server.progress import report_progress
from parenting.server.queue.answers import answer, get_query
from parenting.server.queue.corrections import take_correction, withdraw_guidance
from parenting.server.queue.repairs import repair
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query, take_answer, take_operator_events
from parenting.server.runs import Claim, claim
from parenting.server.statuses import RunStatus
from parenting.server.tables import CheckpointPart, Table
from parenting.server.weights import put_bytes
from parenting.server.why import Why
from tests.server.conftest import CLIPS, Clock
from tests.tree import ROOT

WORKERS = {
    "board.store.write": "board",
    "checkpoint_parts._short_write": "parts",
    "checkpoints._store": "checkpoint",
    "jobs._set": "job",
    "jobs.let_go": "job",
    "jobs.renew": "job",
    "machine.write": "machine",
    "metrics.write_metrics": "metrics",
    "moves.MovesWriter.write": "moves",
    "queue.corrections.take_correction": "correction",
    "queue.corrections.withdraw_guidance": "withdrawal",
    "queue.repairs.repair": "repair",
    "queue.worker_side.post_query": "question",
    "queue.worker_side.take_answer": "answer",
    "queue.worker_side.take_operator_events": "event",
    "runs.finish": "end",
    "runs.let_go": "release",
    "progress.report_progress": "progress",
    "weights.put_bytes": "weights",
    "why.Why.write": "why",
}
"""The functions by which workers write for a run or a job, and the trial of each with a stale token."""
OTHERS = {
    "claims": {"jobs._claim", "runs.claim"},
    "a worker's own row": {"workers.sign", "workers.sign_off"},
    "chores: rows of runs that nobody may claim": {"checkpoints.thin", "deletion.piece", "weights.sweep"},
    "when sessions and tokens were used last, and what was refused": {
        "access.door.Door._write",
        "audit.refusals.Refusals._store",
    },
    "pages, API and commands": {
        "access.sessions",
        "access.tokens",
        "archive.importing.import_export",
        "audit.recording.note_export",
        "audit.recording.try_note_export",
        "batches._store",
        "deletion.begin",
        "deps._alone",
        "erasing._take_over",
        "erasure.begin",
        "erasure.finish",
        "group_commit.GroupCommit",
        "identity.renew",
        "keeping",
        "jobs.ask",
        "jobs.ask_of_no_run",
        "jobs.cancel",
        "migrate",
        "new_run.start",
        "operator_events.add_operator_event",
        "operator_events.end_episode_that_stands_still",
        "persons.name_person",
        "queue.answers.answer",
        "queue.leases",
        "queue.presence",
        "queue.revisions",
        "queue.skips.skip",
        "rollback.roll_back",
        "runs.set_goal",
        "runs.set_pace",
        "runs.set_status",
        "transfer.ends.target",
    },
}


def writers(node: ast.AST, name: str) -> Iterator[str]:
    """The functions below a node that begin a transaction which writes."""
    for child in ast.iter_child_nodes(node):
        inner = name
        if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            inner = f"{name}.{child.name}"
        if isinstance(child, ast.Call) and isinstance(child.func, ast.Attribute):
            of = ast.unparse(child.func.value).rpartition(".")[2]
            if child.func.attr in ("write", "write_unseen") and of in ("db", "_db"):
                yield name
        yield from writers(child, inner)


def test_every_function_that_writes_is_fenced_or_says_why_not() -> None:
    server = ROOT / "server"
    found = {
        name
        for file in sorted(server.rglob("*.py"))
        for name in writers(
            ast.parse(file.read_text("utf-8")), ".".join(file.relative_to(server).with_suffix("").parts)
        )
    }
    known = {*WORKERS, *(name for names in OTHERS.values() for name in names)}
    unknown = {name for name in found if not any(name == one or name.startswith(f"{one}.") for one in known)}
    assert not unknown
    assert found >= set(WORKERS)
    assert set(WORKERS.values()) == set(TRIALS)


@pytest.fixture
def stale(db: Database, mine: Claim, guidance: int, clock: Clock) -> Claim:
    """A claim that another worker has taken, of a run with something for each verb to write."""
    answer(db, guidance, "left", "tab", "human")
    assert take_answer(db, mine, 6) is not None
    supersede(db, guidance, "right", "tab", "human")  # a correction that waits
    write_parts(db, mine, b"left over")
    save_checkpoint(db, mine, 5, b"state")
    post_query(db, mine, 7, "guidance", 1, CLIPS)
    add_operator_event(db, mine.run_id, "mature", {})
    clock.pass_seconds(6)
    (taken,) = claim(db, "worker-2")
    assert (taken.run_id, taken.fencing_token) == (mine.run_id, mine.fencing_token + 1)
    return mine


def stale_job(db: Database, clock: Any) -> JobClaim:
    """A claim of a job that another worker has taken."""
    jobs.ask_of_no_run(db, "pretrain", {}, "me")
    (mine,) = jobs.claim(db, "worker-1", 1)
    clock.pass_seconds(6)
    assert jobs.claim(db, "worker-2", 1)
    return mine


def contents(db: Database) -> dict[str, list[Any]]:
    tables = Table.metadata.sorted_tables
    with db.read() as session:
        return {one.name: sorted(map(repr, session.execute(select(one)))) for one in tables}


def moves(db: Database, mine: Claim) -> None:
    writer = MovesWriter(db, mine, 0)
    writer.note(1)
    writer.write()


def why(db: Database, mine: Claim) -> None:
    seen = object.__new__(Why)
    seen._db, seen._mine, seen._reasons, seen._effects = db, mine, {5: {}}, {}
    seen.write()


def repaired(db: Database, mine: Claim) -> None:
    with db.read() as session:
        number = session.scalars(select(CheckpointPart.id)).first()
    assert number is not None
    repair(db, mine, get_query(db, 1), {"kind": "preference"}, True)


SNAPSHOT = board.Numbers(tick=5, stage=1, answers=0, p_guid=0.5, states=0, blob=b"")
TRIALS: dict[str, list[Callable[[Database, Claim], Any]]] = {
    "answer": [lambda db, mine: take_answer(db, mine, 9)],
    "board": [lambda db, mine: board.write(db, mine, None, True, [SNAPSHOT], 1)],
    "checkpoint": [lambda db, mine: save_checkpoint(db, mine, 9, b"stale")],
    "correction": [lambda db, mine: take_correction(db, mine, 9)],
    "end": [lambda db, mine: runs.finish(db, mine, RunStatus.FINISHED, "Over.")],
    "event": [lambda db, mine: take_operator_events(db, mine, 9)],
    "machine": [lambda db, mine: write_notes(db, mine, [])],
    "metrics": [lambda db, mine: write_metrics(db, mine, {5: {"loss": 0.5}})],
    "moves": [moves],
    "parts": [lambda db, mine: write_parts(db, mine, b"stale"), sweep_parts],
    "progress": [lambda db, mine: report_progress(db, mine, tick=9)],
    "question": [lambda db, mine: post_query(db, mine, 9, "guidance", 1, CLIPS)],
    "repair": [repaired],
    "why": [why],
    "withdrawal": [lambda db, mine: withdraw_guidance(db, mine, 9)],
    "release": [],
    "job": [],
    "weights": [],
}


def test_a_run_is_written_by_nobody_whose_token_is_stale(db: Database, stale: Claim) -> None:
    before = contents(db)
    for name, trials in TRIALS.items():
        for trial in trials:
            with pytest.raises(LostClaimError):
                trial(db, stale)
            assert contents(db) == before, name
    runs.let_go(db, [stale])
    assert contents(db) == before


def test_a_job_is_written_by_nobody_whose_token_is_stale(db: Database, clock: Clock) -> None:
    mine = stale_job(db, clock)
    before = contents(db)
    for trial in (
        lambda: jobs.tell(db, mine, {"steps": 1}),
        lambda: jobs.finish(db, mine, {}),
        lambda: jobs.fail(db, mine, "No."),
        lambda: put_bytes(db, "made", b"weights", lambda session: jobs.hold(session, mine)),
    ):
        with pytest.raises(LostClaimError):
            trial()
    jobs.renew(db, [mine])
    jobs.let_go(db, [mine])
    assert contents(db) == before


def test_the_token_that_holds_writes(db: Database, mine: Claim, guidance: int) -> None:
    """The trials are refused for their token alone."""
    for name in ("checkpoint", "metrics", "moves", "parts", "board", "question", "progress", "end"):
        before = contents(db)
        TRIALS[name][0](db, mine)
        assert contents(db) != before, name
