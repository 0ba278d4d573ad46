"""A run goes on on another CPU: nothing of its record is lost, and X is what the parent said.

A CPU is forced in a process of its own, whose start takes seconds.
"""

from __future__ import annotations

import os
from typing import Any

import pytest
import torch
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server import checkpoints, machine, runs, snapshot
from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.notes import MachineChanged, notes
from parenting.server.reads.answers import every
from parenting.server.replay import relive
from parenting.server.settings import Settings
from parenting.server.snapshot import changed, versions
from parenting.server.verify import verify
from tests.server.another_machine import RUN, live_to, raised_elsewhere, taken_up
from tests.server.raising import ISLAND

CHECKPOINT, KILLED, END = 20, 110, 150
HERE = torch.backends.cpu.get_cpu_capability()


@pytest.fixture(autouse=True)
def no_checkpoint_by_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 1e9)


@pytest.fixture
def followed(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The ticks at which the agent asked otherwise than its record."""
    ticks: list[int] = []

    def follow(state: Any, *asked: Any) -> Any:
        ticks.append(int(state.keys.tick[0]))
        return machine.follow(state, *asked)

    monkeypatch.setattr("parenting.server.session.follow", follow)
    return ticks


Record = list[tuple[Any, ...]]


def record(db: Database, until: int) -> Record:
    """Return questions and answers up to a tick, without what may change later."""
    return [
        (row.query.id, row.query.tick, row.query.clips, row.answer.choice, row.answer.applied_tick)
        for row in every(db, RUN)
        if row.query.tick <= until
    ]


def changes(db: Database) -> list[tuple[int, MachineChanged]]:
    return [(tick, note) for tick, note in notes(db, RUN) if isinstance(note, MachineChanged)]


needs_two = pytest.mark.skipif(HERE == "DEFAULT", reason="this CPU has no vector instructions to leave out")


@pytest.mark.slow
@pytest.mark.faults
@needs_two
@pytest.mark.only("sqlite")
def test_it_goes_on_where_the_other_cpu_was_killed(db: Database, settings: Settings) -> None:
    """Killed between its checkpoint and the end of its record."""
    start(db, ISLAND.new("scripted"))
    assert raised_elsewhere(settings, "default", CHECKPOINT, KILLED) == "DEFAULT"
    before = record(db, KILLED)
    assert len(before) > 20
    life = taken_up(db)
    assert life.last_tick == CHECKPOINT
    live_to(life, END)
    life.save()
    assert record(db, KILLED)[: len(before) - 1] == before[:-1]  # the last may have been heard since
    ((tick, note),) = changes(db)
    assert (tick, note.before["cpu"], note.after["cpu"]) == (CHECKPOINT + 1, "DEFAULT", HERE)
    found = verify(db, RUN)
    assert found.x is None
    assert found.chain.problems == []
    assert "Bits are not comparable" in str(found.machine)


@pytest.mark.slow
@pytest.mark.faults
@needs_two
@pytest.mark.only("sqlite")
def test_the_other_way_and_killed_again_within_the_record(db: Database, settings: Settings) -> None:
    """From this CPU to the other, killed before a new checkpoint, and back: nobody asks anything twice."""
    start(db, ISLAND.new("scripted"))
    life = taken_up(db)
    live_to(life, CHECKPOINT)
    life.save()
    live_to(life, KILLED)
    before = record(db, KILLED)
    raised_elsewhere(settings, "default", 0, 60)  # killed amid the record of this CPU
    raised_elsewhere(settings, "default", 0, KILLED + 20)  # and again beyond it
    between = record(db, KILLED + 20)
    again = taken_up(db)
    assert again.last_tick == CHECKPOINT
    live_to(again, END)
    again.save()
    assert record(db, KILLED)[: len(before) - 1] == before[:-1]
    assert record(db, KILLED + 20)[: len(between) - 1] == between[:-1]
    assert [note.after["cpu"] for _, note in changes(db)] == ["DEFAULT", HERE]
    assert runs.get_run(db, RUN).status == "active"
    assert verify(db, RUN).x is None


@pytest.mark.slow
@pytest.mark.faults
def test_recorded_questions_stand_where_the_agent_would_ask_others(
    db: Database, followed: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A policy that differs much stands for a CPU that differs little: its questions differ for certain."""
    start(db, ISLAND.new("scripted"))
    life = taken_up(db)
    live_to(life, CHECKPOINT)
    state, learner = life.saved.state, life.saved.state.learner
    other = state.replace(learner=learner.replace(params=learner.params.flip(1)))
    blob = snapshot.pack(life.saved._replace(state=other))
    live_to(life, KILLED)
    before = record(db, KILLED)
    checkpoints.save_checkpoint(db, life.claim, CHECKPOINT, blob)
    here = {**versions(), "cpu": "another"}
    for module in (snapshot, machine):
        monkeypatch.setattr(module, "versions", lambda: here)
    again = taken_up(db)
    live_to(again, END)
    again.save()
    assert CHECKPOINT < followed[0] <= followed[-1] <= KILLED
    assert record(db, KILLED)[: len(before) - 1] == before[:-1]
    assert len(record(db, KILLED)) <= len(before) + 1, "nothing is asked twice"
    assert verify(db, RUN).x is None
    assert verify(db, RUN).chain.problems == []


def test_what_the_bits_depend_on_is_stored(db: Database) -> None:
    start(db, ISLAND.new("scripted"))
    life = taken_up(db)
    live_to(life, 5)
    life.save()
    stored = runs.get_run(db, RUN).versions
    assert stored == versions()
    assert stored is not None
    assert (stored["cpu"], stored["machine"]) == (HERE, os.uname().machine)
    taken_up(db)
    assert changes(db) == [], "the same machine again"


def test_what_was_not_recorded_counts_as_the_same() -> None:
    here = {"torch": "2", "threads": 1, "cpu": "AVX2", "machine": "x86_64"}
    assert not changed({"torch": "2", "threads": 1}, here)
    assert not changed(None, here)
    assert changed({"torch": "2", "threads": 2}, here)
    assert changed({**here, "cpu": "DEFAULT"}, here)
    assert changed({**here, "machine": "aarch64"}, here)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("store", "name"),
    [("sqlite", "torch"), ("sqlite", "threads"), ("sqlite", "machine"), ("postgresql", "cpu")],
    indirect=["store"],
)
def test_a_run_goes_on_with_a_note_whatever_has_changed(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    start(db, ISLAND.new("scripted"))
    life = taken_up(db)
    live_to(life, CHECKPOINT)
    life.save()
    live_to(life, 30)
    before, other = record(db, 30), {**versions(), name: "another"}
    for module in (snapshot, machine):
        monkeypatch.setattr(module, "versions", lambda: other)
    life = taken_up(db)
    live_to(life, 40)
    life.save()
    ((tick, note),) = changes(db)
    assert (tick, note.before, note.after, note.until) == (
        CHECKPOINT + 1,
        versions(),
        other,
        max(row[1] for row in before) if before[-1][4] is None else note.until,
    )
    found = relive(db, RUN)
    assert (found.until, found.tick, found.equal) == (CHECKPOINT, CHECKPOINT, True)
    monkeypatch.setenv("PARENTING_DATA", str(settings.data))
    monkeypatch.setenv("PARENTING_DATABASE_URL", settings.url)
    said = CliRunner().invoke(app, ["verify", str(RUN)])
    assert said.exit_code == 0, said.output
    assert "the chain of hashes holds" in said.stdout
    assert f"Another machine went on with the run at tick {CHECKPOINT + 1}" in said.stdout
    assert "X is what the answers make it, up to tick 40." in said.stdout
