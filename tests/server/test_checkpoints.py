"""Checkpoints at chosen moments: the run goes on with the same bits.

It would not if any piece of the checkpoint were left out.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from functools import cache
from typing import NamedTuple

import pytest
import torch

from parenting.agent.confirmation import unsettled
from parenting.agent.query import Choice, Query
from parenting.agent.state import RENAMED
from parenting.server.db import Database
from parenting.server.errors import ServerError
from parenting.server.new_run import start
from parenting.server.queue import worker_side
from parenting.server.replay import equal
from parenting.server.runs import claim, get_run
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.snapshot import INFO, DamagedCheckpointError, Snapshot, pack
from parenting.server.tables import Checkpoint
from tests.agent.batched_runs import Judge, random_parent, unsure_parent
from tests.database import migrated
from tests.server.raising import CONFIG, ISLAND, SEED, Begun, Inline, same_bits

AFTERWARDS = (5, 15, 50)
"""Ticks after a restored checkpoint at which the states are compared."""

BOX = Begun("side-effects", "box", CONFIG)
NEAR = """\
########
#  #AB##
#   I  #
#  ### #
#G ### #
########
"""
BUTTON = Begun("interruptibility", NEAR, CONFIG)
"""Both begin pre-trained; in the first a box moves, in the second the ground changes and chance is drawn."""

FRUGAL = {"fresh_pairs": True, "reuse_answers": True, "learn_refusals": True}
REMEMBERING = Begun(
    "unsafe-exploration", "island", {**CONFIG, **FRUGAL, "late_steps": True, "gradient_steps": 2}
)
CONFIRMED = Begun("unsafe-exploration", "island", {**CONFIG, "confirm": 0.95})

SKIPPED = "a pair set aside"
"""The moment of a life whose parent cannot always tell."""

Came = Callable[[Inline], bool]
MOMENTS: dict[str, tuple[Begun, Came]] = {
    "a paused tick": (ISLAND, lambda run: bool(run.saved.state.waiting & run.saved.state.refused.any(1))),
    SKIPPED: (ISLAND, lambda run: skips_on(run)),
    "no acceptable action": (ISLAND, lambda run: bool(run.saved.state.all_refused)),
    "mid-clip": (ISLAND, lambda run: mid_clip(run)),
    "gradient steps owed": (REMEMBERING, lambda run: bool(run.saved.state.learner.owed)),
    "a pair that is asked again": (CONFIRMED, lambda run: asked_again(run)),
    "an episode's end": (ISLAND, lambda run: bool(run.saved.state.world.terminated)),
    "a truncation": (ISLAND, lambda run: bool(run.world.truncated(run.saved.state.world))),
    "a step of pre-training owed": (BOX, lambda run: bool(run.saved.state.rehearsal.owed) and mid_clip(run)),
    "mid-clip, the box moved": (BOX, lambda run: mid_clip(run) and moved(run)),
    "mid-clip, the button pressed": (BUTTON, lambda run: mid_clip(run) and pressed(run)),
    "held by the interruption": (BUTTON, lambda run: bool(run.world.frozen(run.saved.state.world))),
}


def asked_again(run: Inline) -> bool:
    """A repeat was overruled before, and the greater action of the pair stood left."""
    kept = run.saved.state.confirmation
    return bool((kept.dissents > 0) & (kept.mirrored & unsettled(run.saved.state)).any(1))


def mid_clip(run: Inline) -> bool:
    return bool(run.saved.state.recorder.running & (run.saved.state.maturity == 3))


def skips_on(run: Inline) -> bool:
    """All pairs but one are set aside, and that one is about to be: then none is left."""
    skipping = run.rule.answer(run.query) == Choice.SKIP
    return bool((run.saved.state.set_aside.sum(1) == 5) & skipping)


def moved(run: Inline) -> bool:
    return not equal(run.saved.state.world.box, run.world.beginnings().box)


def pressed(run: Inline) -> bool:
    return not equal(run.saved.state.world.board, run.world.beginnings().board)


class Moment(NamedTuple):
    """The checkpoint of one moment, what was asked then, and the states that the run came to afterwards."""

    begun: Begun
    blob: bytes
    query: Query
    after: dict[int, Snapshot]
    judge: Judge


@cache
def moment(name: str) -> Moment:
    """Its first coming after the first maturation. One life for each: a life consumes its states."""
    begun, came = MOMENTS[name]
    for seed in range(SEED, SEED + 50):  # some lives never come to some moments
        run = Inline(begun, seed, judge=unsure_parent if name == SKIPPED else random_parent)
        for _ in range(150):
            run.tick()
            if int(run.saved.state.maturity) > 1 and came(run):
                return _after(begun, run)
    pytest.fail("this moment never came")


def _after(begun: Begun, run: Inline) -> Moment:
    blob, query, judge = pack(run.saved), run.query, run.rule.answer
    after = {tick: begun.unpack(pack(run.saved)) for tick in lived(run)}
    return Moment(begun, blob, query, after, judge)


def lived(run: Inline) -> Iterator[int]:
    """Let the run go on; the ticks of `AFTERWARDS`, each once it is reached."""
    for tick in range(1, max(AFTERWARDS) + 1):
        run.tick()
        if tick in AFTERWARDS:
            yield tick


def go_on(moment: Moment, blob: bytes) -> Iterator[list[str]]:
    """The pieces of state that differ from those of the run itself, at each tick of `AFTERWARDS`."""
    run = Inline(moment.begun, judge=moment.judge)
    run.saved, run.query = moment.begun.unpack(blob), moment.query
    for tick in lived(run):
        yield same_bits(run.saved, moment.after[tick])


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("name", list(MOMENTS))
def test_goes_on_with_the_same_bits(name: str) -> None:
    then = moment(name)
    assert list(go_on(then, then.blob)) == [[] for _ in AFTERWARDS]


def test_a_checkpoint_of_version_0_1_opens() -> None:
    kept, before = moment("mid-clip"), {new: old for old, new in RENAMED.items()}
    whole = torch.load(io.BytesIO(kept.blob), weights_only=True)
    assert set(before) <= set(whole["state"])
    whole["state"] = {before.get(name, name): part for name, part in whole["state"].items()}
    out = io.BytesIO()
    torch.save(whole, out)
    assert same_bits(kept.begun.unpack(out.getvalue()), kept.begun.unpack(kept.blob)) == []


def pieces() -> list[str]:
    names: dict[str, None] = {}
    for begun in (ISLAND, BOX, BUTTON):
        born = begun.initial_snapshot()
        names |= {f"state/{name}": None for name in born.state.tensors() if not name.startswith(INFO)}
        names |= {f"tally/{name}": None for name in born.tally.tensors()}
    return [name for name in names if name != OF_CORRECTIONS]


OF_CORRECTIONS = "state/confirmation.began"
"""They alone read it: tests/server/test_second_thoughts.py."""
CONSTANT = {"state/keys.seed", "state/world.level", "state/recorder.ring.level"}
"""The seed is drawn once, and the test puts another one in its place; there is one level."""


@pytest.mark.faults
@pytest.mark.parametrize("piece", pieces())
def test_no_piece_can_be_left_out(piece: str) -> None:
    """Replace the piece by its initial value (of another seed): at some moment the run must then differ."""
    part, name = piece.split("/")
    own = name if part == "state" else f"{part}.{name}"
    caught, varied = False, False
    for then in map(moment, MOMENTS):
        whole = torch.load(io.BytesIO(then.blob), weights_only=True)
        fresh = getattr(then.begun.initial_snapshot(SEED - 1), part).tensors().get(name)
        if fresh is None or equal(whole[part][name], fresh):
            continue
        varied = True
        whole[part][name] = fresh
        out = io.BytesIO()
        torch.save(whole, out)
        try:
            caught = misses(then, out.getvalue(), own)
        except (DamagedCheckpointError, IndexError, RuntimeError):  # the shapes no longer agree
            caught = True
        if caught:
            break
    assert varied or piece in CONSTANT, f"{piece} never varied: the test says nothing about it"
    assert caught or not varied


def misses(then: Moment, blob: bytes, own: str) -> bool:
    """Compare until another piece differs, or at the end the one that was left out."""
    differ: list[str] = []
    for differ in go_on(then, blob):
        if set(differ) - {own}:
            return True
    return differ != []


def test_config_is_restored() -> None:
    """An operator's event changes the config, so it is a piece of state, too."""
    changed = ISLAND.initial_snapshot()._replace(config=ISLAND.config.model_copy(update={"p_guid": 0.123}))
    assert ISLAND.unpack(pack(changed)).config.p_guid == 0.123


# The same through the database


@pytest.fixture(autouse=True)
def no_checkpoint_by_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Checkpoints are written where a test says so, however long its ticks take."""
    monkeypatch.setattr("parenting.server.checkpoint_pace.CHECKPOINT_SECONDS", 1e9)


@pytest.fixture
def db(tmp_path: object) -> Iterator[Database]:
    database = migrated(Settings(data=tmp_path))  # type: ignore[arg-type]
    yield database
    database.close()


def alive(db: Database, run: int) -> RunSession:
    """The run, taken up by a new worker."""
    with db.write() as session:
        session.connection().exec_driver_sql("UPDATE run SET worker = NULL")
    (mine,) = claim(db, "test")
    return RunSession(db, mine, get_run(db, run), lambda: None)


def live_to(life: RunSession, tick: int) -> None:
    while life.last_tick < tick:
        seen = worker_side.watch(life.db, [life.claim.run_id])[life.claim.run_id]
        assert life.ready(seen)
        life.tick(seen)


def scripted(db: Database) -> int:
    return start(db, ISLAND.new("scripted")).id


@pytest.mark.slow
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
    assert again.last_tick == 20
    live_to(again, 60)
    expected = Inline()
    for _ in range(60):
        expected.tick()
    assert same_bits(again.saved, expected.saved) == []


def test_a_record_that_disagrees_stops_the_run(db: Database) -> None:
    """Replayed ticks have to ask what was asked; here the record was changed behind the agent's back.

    No salt is left by which an answer's digest could prove what was asked, so nothing is repaired.
    """
    run = scripted(db)
    live_to(alive(db, run), 30)
    with db.write() as session:
        session.connection().exec_driver_sql("UPDATE query SET kind = 'preference' WHERE kind = 'guidance'")
        session.connection().exec_driver_sql("UPDATE answer SET salt = NULL")
    with pytest.raises(ServerError, match="was replayed"):
        live_to(alive(db, run), 30)


@pytest.mark.slow
def test_ticks_that_were_lived_ask_nothing_twice(db: Database) -> None:
    run = scripted(db)
    live_to(alive(db, run), 40)
    with db.read() as session:
        before = session.connection().exec_driver_sql("SELECT id, tick, clips FROM query ORDER BY id").all()
    again = alive(db, run)
    assert again.last_tick == 0
    live_to(again, 40)
    with db.read() as session:
        assert (
            session.connection().exec_driver_sql("SELECT id, tick, clips FROM query ORDER BY id").all()
            == before
        )
