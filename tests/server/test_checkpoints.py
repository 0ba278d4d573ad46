"""Checkpoints at chosen moments: the run goes on with the same bits, and would not if any piece were left
out.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import pytest
import torch

from server import mailbox
from server.checkpoint import REPORT, Saved, birth, pack, unpack, versions
from server.db import Database, connect
from server.errors import ServerError
from server.life import Life
from server.runs import claim, get_run
from server.schema import upgrade
from server.settings import Settings
from server.starting import NewRun, start
from server.tables import Checkpoint
from tests.agent.lives import capricious
from tests.server.raising import CONFIG, SEED, WORLD, Inline, equal, same_bits, world_and_config

AFTERWARDS = 50
"""Ticks that are lived after a restored checkpoint, before the states are compared."""

MOMENTS: dict[str, Callable[[Inline], bool]] = {
    "a paused tick": lambda run: bool(run.saved.state.waiting & run.saved.state.refused.any(1)),
    "no acceptable action": lambda run: bool(run.saved.state.stuck),
    "mid-clip": lambda run: bool(run.saved.state.recorder.running & (run.saved.state.maturity == 3)),
    "an episode's end": lambda run: bool(run.saved.state.world.over),
    "a truncation": lambda run: bool(run.world.truncated(run.saved.state.world)),
}


class Moment(NamedTuple):
    """The checkpoint of one moment, what was asked then, and the state that the run came to afterwards."""

    blob: bytes
    query: object
    after: Saved


@cache
def moments() -> dict[str, Moment]:
    """Each moment's first coming after the first maturation. One life of its own each: a life consumes its
    states.
    """
    return {name: _moment(came) for name, came in MOMENTS.items()}


def _moment(came: Callable[[Inline], bool]) -> Moment:
    for seed in range(SEED, SEED + 50):  # some lives never come to some moments
        run = Inline(seed, judge=capricious)
        for _ in range(150):
            run.tick()
            if int(run.saved.state.maturity) > 1 and came(run):
                return _after(run)
    pytest.fail("this moment never came")


def _after(run: Inline) -> Moment:
    blob, query = pack(run.saved), run.query
    for _ in range(AFTERWARDS):
        run.tick()
    return Moment(blob, query, run.saved)


def go_on(saved: Saved, query: object) -> Saved:
    run = Inline(judge=capricious)
    run.saved, run.query = saved, query  # type: ignore[assignment]
    for _ in range(AFTERWARDS):
        run.tick()
    return run.saved


@pytest.mark.parametrize("name", list(MOMENTS))
def test_goes_on_with_the_same_bits(name: str) -> None:
    blob, query, after = moments()[name]
    assert same_bits(go_on(unpack(*world_and_config(), blob), query), after) == []


def pieces() -> list[str]:
    born = birth(*world_and_config(), SEED)
    names = [f"state/{name}" for name in born.state.tensors() if not name.startswith(REPORT)]
    return names + [f"tally/{name}" for name in born.tally.tensors()]


CONSTANT = {
    "state/keys.seed",  # drawn once; the test puts another seed in its place
    "state/world.board",  # the island's ground stays as it is
    "state/world.box",  # it has no box
    "state/world.level",  # and one level
    "state/recorder.ring.level",
}


@pytest.mark.parametrize("piece", pieces())
def test_no_piece_can_be_left_out(piece: str) -> None:
    """Put the piece's value at birth (of another seed) in its place: at some moment the run must come out
    otherwise.
    """
    part, name = piece.split("/")
    caught, varied = False, False
    for blob, query, after in moments().values():
        whole = torch.load(io.BytesIO(blob), weights_only=True)
        fresh = getattr(birth(*world_and_config(), SEED - 1), part).tensors()[name]
        if equal(whole[part][name], fresh):
            continue
        varied = True
        whole[part][name] = fresh
        out = io.BytesIO()
        torch.save(whole, out)
        try:
            caught = same_bits(go_on(unpack(*world_and_config(), out.getvalue()), query), after) != []
        except (TypeError, IndexError, RuntimeError):  # the shapes no longer agree
            caught = True
        if caught:
            break
    assert varied or piece in CONSTANT, f"{piece} never varied: the test says nothing about it"
    assert caught or not varied


def test_config_is_restored() -> None:
    """An operator's event changes the config, so it is a piece of state, too."""
    world, config = world_and_config()
    changed = birth(world, config, SEED)._replace(config=config.model_copy(update={"p_guid": 0.123}))
    assert unpack(world, config, pack(changed)).config.p_guid == 0.123


def test_other_threads_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    world, config = world_and_config()
    blob = pack(birth(world, config, SEED))
    monkeypatch.setattr("server.checkpoint.versions", lambda: {**versions(), "threads": 99})
    with pytest.raises(ServerError, match="99"):
        unpack(world, config, blob)


# The same through the database


@pytest.fixture
def db(tmp_path: object) -> Iterator[Database]:
    database = connect(Settings(data=tmp_path))  # type: ignore[arg-type]
    upgrade(database)
    yield database
    database.close()


def alive(db: Database, run: int) -> Life:
    """The run, taken up by a new worker."""
    with db.write() as session:
        session.connection().exec_driver_sql("UPDATE run SET actor = NULL")
    (mine,) = claim(db, "test")
    return Life(db, mine, get_run(db, run), lambda: None)


def live_to(life: Life, tick: int) -> None:
    while life.tick < tick:
        seen = mailbox.watch(life.db, [life.mine.run_id])[life.mine.run_id]
        assert life.ready(seen)
        life.beat(seen)


def scripted(db: Database) -> int:
    return start(db, NewRun(world=WORLD, preset="lax", parent="scripted", config=dict(CONFIG), seed=SEED)).id


def test_a_damaged_checkpoint_is_passed_over(db: Database) -> None:
    run = scripted(db)
    life = alive(db, run)
    for tick in (20, 40):
        live_to(life, tick)
        life.save()
    with db.write() as session:
        newest = session.query(Checkpoint).order_by(Checkpoint.id.desc()).first()
        assert newest is not None
        newest.blob = newest.blob[:-100] + bytes(100)
    again = alive(db, run)
    assert again.tick == 20
    live_to(again, 60)
    expected = Inline()
    for _ in range(60):
        expected.tick()
    assert same_bits(again.saved, expected.saved) == []


def test_a_record_that_disagrees_stops_the_run(db: Database) -> None:
    """Replayed ticks have to ask what was asked; here the record was changed behind the agent's back."""
    run = scripted(db)
    live_to(alive(db, run), 30)
    with db.write() as session:
        session.connection().exec_driver_sql("UPDATE query SET kind = 'preference' WHERE kind = 'guidance'")
    with pytest.raises(ServerError, match="lived again"):
        live_to(alive(db, run), 30)


def test_ticks_that_were_lived_ask_nothing_twice(db: Database) -> None:
    run = scripted(db)
    live_to(alive(db, run), 40)
    with db.read() as session:
        before = session.connection().exec_driver_sql("SELECT id, tick, clips FROM query ORDER BY id").all()
    again = alive(db, run)
    assert again.tick == 0
    live_to(again, 40)
    with db.read() as session:
        assert (
            session.connection().exec_driver_sql("SELECT id, tick, clips FROM query ORDER BY id").all()
            == before
        )
