"""An ended run goes on; a failed run keeps its reason.

Each goes on from its last good checkpoint, as if nothing had happened.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import httpx2
import pytest
from sqlalchemy import text
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server import runs
from parenting.server.checkpoints import load_checkpoints
from parenting.server.db import Database
from parenting.server.errors import Conflict
from parenting.server.migrate import downgrade, upgrade
from parenting.server.new_run import start
from parenting.server.notes import CheckpointDamaged, Failed, Resumed, notes
from parenting.server.operator_events import add_operator_event
from parenting.server.queue import worker_side
from parenting.server.queue.answers import get_query
from parenting.server.queue.corrections import withdraw_guidance
from parenting.server.queue.queries import open_counts
from parenting.server.runs import Claim
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.snapshot import DivergedError, pack
from parenting.server.statuses import RunStatus
from parenting.server.tables import Checkpoint
from parenting.server.work.held import HeldRuns
from parenting.server.work.patience import Patience
from parenting.server.worker import Worker
from tests.server.conftest import CLIPS
from tests.server.raising import ISLAND, inline, same_bits

RUN = 1
REASON = "The agent could not go on: for a test."


@pytest.fixture(autouse=True)
def no_checkpoint_by_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 1e9)


def taken_up(db: Database) -> RunSession:
    with db.write() as session:
        session.execute(text("UPDATE run SET worker = NULL"))
    (mine,) = runs.claim(db, "worker")
    return RunSession(db, mine, runs.get_run(db, RUN), lambda: None)


def live_to(life: RunSession, tick: int) -> None:
    while life.last_tick < tick:
        seen = worker_side.watch(life.db, [RUN])[RUN]
        assert life.ready(seen)
        life.tick(seen)


def fail(life: RunSession) -> None:
    runs.finish(life.db, life.claim, RunStatus.FAILED, REASON, "Traceback ...")


def lived(db: Database, *saved_at: int, to: int = 40) -> RunSession:
    """A scripted run that has come to a tick, with its checkpoints."""
    start(db, ISLAND.new("scripted"))
    life = taken_up(db)
    for tick in saved_at:
        live_to(life, tick)
        life.save()
    live_to(life, to)
    return life


def by_api(db: Database, client: httpx2.Client) -> None:
    assert client.post(f"/api/v1/runs/{RUN}/resume").json()["status"] == "active"


def by_page(db: Database, client: httpx2.Client) -> None:
    shown = client.get(f"/runs/{RUN}").text
    assert REASON in shown
    assert "Retry this run" in shown
    assert client.post(f"/runs/{RUN}/status", data={"status": "active"}).status_code == 200


def by_command(db: Database, client: httpx2.Client) -> None:
    said = CliRunner().invoke(app, ["resume", str(RUN)])
    assert (said.exit_code, said.stdout) == (0, "Run 1 goes on as soon as a worker takes it up.\n"), (
        said.output
    )


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("resume", [by_api, by_page, by_command])
def test_it_goes_on_with_the_same_bits_and_keeps_its_reason(
    db: Database,
    client: httpx2.Client,
    settings: Settings,
    monkeypatch: pytest.MonkeyPatch,
    resume: Callable[[Database, httpx2.Client], None],
) -> None:
    monkeypatch.setenv("PARENTING_DATA", str(settings.data))
    monkeypatch.setenv("PARENTING_DATABASE_URL", settings.url)
    fail(lived(db, 20))
    assert client.get(f"/api/v1/runs/{RUN}").json()["reason"] == REASON
    resume(db, client)
    again = taken_up(db)
    assert (again.last_tick, runs.get_run(db, RUN).reason) == (20, None)
    live_to(again, 60)
    assert same_bits(again.saved, inline(60)) == []
    assert [note for _, note in notes(db, RUN)] == [Failed(reason=REASON), Resumed()]
    assert f"The run failed: {REASON}" in client.get(f"/runs/{RUN}").text
    logged = client.get(f"/api/v1/runs/{RUN}/operator-events").json()["rows"]
    assert [row["event"]["kind"] for row in logged] == ["failed", "resumed"]


@pytest.mark.parametrize("status", [RunStatus.FAILED, RunStatus.STOPPED])
def test_a_question_that_was_open_is_asked_again(db: Database, status: RunStatus) -> None:
    start(db, ISLAND.new("human"))
    life = taken_up(db)
    while not open_counts(db, RUN).guidance:
        live_to(life, life.last_tick + 1)
    asked = worker_side.asked_at(db, RUN, life.last_tick)
    runs.finish(db, life.claim, status, REASON)
    assert open_counts(db, RUN).guidance == 0
    runs.set_status(db, RUN, RunStatus.ACTIVE)
    again = worker_side.asked_at(db, RUN, life.last_tick)
    assert asked is not None
    assert again is not None
    assert (again.id, again.status, open_counts(db, RUN).guidance) == (asked.id, "open", 1)


@pytest.mark.parametrize("ended", ["by its run", "by a correction", "by an episode's end"])
def test_guidance_that_the_agent_waits_for_no_more_is_not_asked_again(
    db: Database, mine: Claim, ended: str
) -> None:
    """The run ends as the worker marks the event: what its end withdrew is known all the same."""
    asked = worker_side.post_query(db, mine, 5, "guidance", 1, CLIPS)
    if ended == "by an episode's end":
        add_operator_event(db, RUN, "end_episode", {})
    runs.set_status(db, RUN, RunStatus.STOPPED)
    if ended == "by a correction":
        withdraw_guidance(db, mine, 6)
    elif ended == "by an episode's end":
        worker_side.take_operator_events(db, mine, 6)
    runs.set_status(db, RUN, RunStatus.ACTIVE)
    assert get_query(db, asked).status == ("open" if ended == "by its run" else "withdrawn")


def test_a_migration_knows_the_guidance_of_episodes_that_were_ended(db: Database, mine: Claim) -> None:
    before = worker_side.post_query(db, mine, 5, "guidance", 1, CLIPS)
    add_operator_event(db, RUN, "end_episode", {})
    worker_side.take_operator_events(db, mine, 6)
    since = worker_side.post_query(db, mine, 7, "guidance", 1, CLIPS)
    runs.set_status(db, RUN, RunStatus.STOPPED)
    downgrade(db, "0012")
    upgrade(db)
    runs.set_status(db, RUN, RunStatus.ACTIVE)
    assert [get_query(db, asked).status for asked in (before, since)] == ["withdrawn", "open"]


def end_and_let_the_worker_hear(life: RunSession) -> None:
    runs.set_status(life.db, RUN, RunStatus.STOPPED, "Stopped by the operator.")
    held = HeldRuns(life.db, Patience(), lambda run: None)
    held.claims[RUN], held.sessions[RUN] = life.claim, life
    held.turn(RUN, worker_side.watch(life.db, [RUN])[RUN])


@pytest.mark.slow
def test_an_ended_run_goes_on_with_the_same_bits_as_if_nobody_had_ended_it(db: Database) -> None:
    end_and_let_the_worker_hear(lived(db, 20))
    runs.set_status(db, RUN, RunStatus.ACTIVE)
    (mine,) = runs.claim(db, "another")  # at once: its last worker has let go
    again = RunSession(db, mine, runs.get_run(db, RUN), lambda: None)
    assert (again.last_tick, runs.get_run(db, RUN).reason) == (40, None)
    live_to(again, 60)
    assert same_bits(again.saved, inline(60)) == []
    assert [note for _, note in notes(db, RUN)] == [Resumed()]


def test_a_finished_run_does_not_come_back(db: Database) -> None:
    runs.finish(db, lived(db, to=5).claim, RunStatus.FINISHED, "Over.")
    with pytest.raises(Conflict):
        runs.set_status(db, RUN, RunStatus.ACTIVE)


def spoil(db: Database, tick: int) -> None:
    """Put other content into a checkpoint, under its right hash."""
    with db.write() as session:
        row = session.query(Checkpoint).filter_by(tick=tick).one()
        row.blob = row.blob[: len(row.blob) // 2] + b"not a tensor" + row.blob[len(row.blob) // 2 :]
        row.sha256 = hashlib.sha256(row.blob).hexdigest()


@pytest.mark.slow
@pytest.mark.parametrize(("spoilt", "expected"), [((30,), 20), ((20, 30), 0)])
def test_a_checkpoint_whose_hash_fits_and_whose_content_does_not_load_is_passed_over(
    db: Database, client: httpx2.Client, spoilt: tuple[int, ...], expected: int
) -> None:
    lived(db, 20, 30)
    for tick in spoilt:
        spoil(db, tick)
    again = taken_up(db)
    assert again.last_tick == expected
    live_to(again, 60)
    assert same_bits(again.saved, inline(60)) == []
    told = [(tick, note.reason) for tick, note in notes(db, RUN) if isinstance(note, CheckpointDamaged)]
    assert [tick for tick, _ in told] == sorted(spoilt, reverse=True)
    assert "weights_only" not in str(told)  # torch's advice would not help a reader
    assert "A damaged checkpoint was passed over" in client.get(f"/runs/{RUN}").text
    again.save()
    assert max(kept.tick for kept in load_checkpoints(db, RUN)) == 60
    taken_up(db)
    assert len([note for _, note in notes(db, RUN)]) == len(spoilt), "each is said once"


@pytest.mark.slow
def test_a_checkpoint_from_which_the_run_departs_from_its_record_is_passed_over(db: Database) -> None:
    """Its content loads, but is not what was written: here it is that of another run's life."""
    lived(db, 20, 30, to=60)
    other = ISLAND.initial_snapshot(seed=999)
    with db.write() as session:
        row = session.query(Checkpoint).filter_by(tick=30).one()
        state = other.state.replace(
            keys=other.state.keys.replace(
                seed=ISLAND.initial_snapshot().state.keys.seed, tick=other.state.keys.tick + 30
            )
        )
        row.blob = pack(other._replace(state=state))
        row.sha256 = hashlib.sha256(row.blob).hexdigest()
    again = taken_up(db)
    assert again.last_tick == 30
    with pytest.raises(DivergedError):
        live_to(again, 60)
    fail(again)
    runs.set_status(db, RUN, RunStatus.ACTIVE)
    third = taken_up(db)
    assert third.last_tick == 20
    live_to(third, 80)
    assert same_bits(third.saved, inline(80)) == []


def test_a_run_that_cannot_be_read_fails_alone(db: Database, settings: Settings) -> None:
    """The worker raises the other run, and says of this one what is damaged."""
    for name in ("victim", "sound"):
        start(db, ISLAND.new("scripted").model_copy(update={"name": name}))
    with db.write() as session:
        session.execute(text("UPDATE run SET config = '{\"stages\": []}' WHERE id = 1"))
    worker = Worker(db, settings)
    worker._claim()
    for _ in range(20):
        worker._round()
    worker._close()
    (_, note), *_ = notes(db, RUN)
    assert isinstance(note, Failed)
    assert "Its stored row is damaged: its config" in note.reason
    assert runs.stored_run(db, RUN).status is RunStatus.FAILED
    assert runs.get_run(db, 2).status is RunStatus.ACTIVE
    assert load_checkpoints(db, 2)
