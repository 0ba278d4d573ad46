"""A run is verified: where its bits part is named, and X is held against the answers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable

import pytest
from sqlalchemy import text
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.settings import Settings
from parenting.server.snapshot import Snapshot, pack
from parenting.server.tables import Checkpoint
from parenting.server.verify import verify
from tests.server.another_machine import RUN, live_to, taken_up
from tests.server.raising import ISLAND

TICKS = 60


@pytest.fixture
def run(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 1e9)
    start(db, ISLAND.new("scripted"))
    life = taken_up(db)
    live_to(life, TICKS)
    life.save()


def rewrite(db: Database, change: Callable[[Snapshot], Snapshot]) -> None:
    """Put another state into the checkpoint, under its right hash."""
    with db.write() as session:
        row = session.query(Checkpoint).one()
        row.blob = pack(change(ISLAND.unpack(row.blob)))
        row.sha256 = hashlib.sha256(row.blob).hexdigest()


@pytest.mark.slow
@pytest.mark.usefixtures("run")
def test_a_sound_run_is_sound(db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch) -> None:
    found = verify(db, RUN)
    assert (found.sound, found.machine, found.x, found.checkpoint) == (True, None, None, TICKS)
    assert found.replayed is not None
    assert found.replayed.equal
    assert found.chain.answers > 10
    monkeypatch.setenv("PARENTING_DATA", str(settings.data))
    monkeypatch.setenv("PARENTING_DATABASE_URL", settings.url)
    said = CliRunner().invoke(app, ["verify", str(RUN), "--json"])
    shown = json.loads(said.stdout)
    assert (said.exit_code, shown["sound"], shown["bits"]["equal"], shown["x"]) == (0, True, True, None)


@pytest.mark.slow
@pytest.mark.usefixtures("run")
def test_a_piece_that_differs_is_named(db: Database) -> None:
    def other_policy(saved: Snapshot) -> Snapshot:
        learner = saved.state.learner.replace(params=saved.state.learner.params + 1e-7)
        return saved._replace(state=saved.state.replace(learner=learner))

    rewrite(db, other_policy)
    found = verify(db, RUN)
    assert found.replayed is not None
    assert (found.sound, found.replayed.differ, found.x) == (False, ["learner.params"], None)


@pytest.mark.slow
@pytest.mark.usefixtures("run")
def test_an_x_that_is_not_its_answers_is_named(db: Database) -> None:
    def other_x(saved: Snapshot) -> Snapshot:
        return saved._replace(state=saved.state.replace(x=saved.state.x.replace(mu=saved.state.x.mu * 2)))

    rewrite(db, other_x)
    found = verify(db, RUN)
    assert not found.sound
    assert found.x == "X is not what the answers make it: mu differ."


@pytest.mark.usefixtures("run")
def test_a_changed_answer_is_found_by_chain_by_bits_and_by_x(
    db: Database, settings: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    with db.write() as session:
        session.execute(
            text(
                "UPDATE answer SET choice = CASE choice WHEN 'left' THEN 'right' ELSE 'left' END "
                "WHERE number = 3"
            )
        )
    found = verify(db, RUN)
    assert found.chain.problems == ["answer 3 or its question was changed"]
    assert found.replayed is not None
    assert not found.replayed.equal
    assert found.x is not None
    monkeypatch.setenv("PARENTING_DATA", str(settings.data))
    monkeypatch.setenv("PARENTING_DATABASE_URL", settings.url)
    said = CliRunner().invoke(app, ["verify", str(RUN)])
    assert said.exit_code == 1
    assert "the chain of hashes has 1 fault" in said.stdout
    assert "answer 3 or its question was changed" in said.stdout


def test_a_run_without_a_checkpoint_has_its_chain_checked(db: Database) -> None:
    start(db, ISLAND.new("scripted"))
    found = verify(db, RUN)
    assert (found.sound, found.checkpoint, found.replayed) == (True, None, None)
