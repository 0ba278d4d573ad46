"""Every world in the database: a run begins with its weights, and lives as it would in tensors."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import torch

from agent import parenting
from agent.birth import world_of
from agent.config import Config
from agent.query import Choice
from envs import registry
from parents.scripted import Judgement, ScriptedParent
from server import mailbox, shelf
from server.checkpoint import Saved, birth
from server.db import Database, connect
from server.errors import Invalid, NotFound
from server.life import Life
from server.record import metrics
from server.runs import claim, get_run
from server.schema import upgrade
from server.settings import Settings
from server.starting import NewRun, start
from server.tally import count
from tests.server.raising import same_bits
from weights.store import Wanted, digest, find, load

LEVELS = [(kind.name, level) for kind in registry.WORLDS.values() for level in kind.levels]
TWO_STAGES = {"stages": 2, "mature_every": 8, "max_open_preferences": 0, "time_limit": 12}
TICKS = 36


@pytest.fixture
def db(tmp_path: Path) -> Iterator[Database]:
    database = connect(Settings(data=tmp_path))
    upgrade(database)
    yield database
    database.close()


def begin(db: Database, world: str, level: str | None = None, **config: object) -> int:
    settings = {**TWO_STAGES, **config}
    new = NewRun(world=world, level=level, parent="scripted", preset="lax", config=settings, seed=4)  # type: ignore[arg-type]
    return start(db, new).id


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


def in_tensors(db: Database, run: int, ticks: int) -> Saved:
    """The same run without a database."""
    row = get_run(db, run)
    config = Config.model_validate(row.config)
    world = world_of(row.world, row.level_text, config)
    weights = None
    if row.weights is not None:
        weights = load(shelf.fetch(db, row.weights), Wanted(world.kind, world.height, world.width))
    state, tally, _ = birth(world, config, row.seed, weights)
    judgement = Judgement(world, config.gamma, inside=config.inside)
    parent = ScriptedParent(judgement, parenting.no_query(world, config, state))
    for _ in range(ticks):
        answer = parent.take(state)
        state, config, _ = parenting.beat(world, config, state, parent)
        tally = count(world, tally, answer, state)
    return Saved(state, tally, config)


def lived(db: Database, run: int) -> Saved:
    """The run to TICKS, taken up again from a checkpoint in the middle, some ticks after it."""
    life = alive(db, run)
    live_to(life, TICKS // 2)
    life.save()
    live_to(life, TICKS // 2 + 5)
    again = alive(db, run)
    assert again.tick == TICKS // 2
    live_to(again, TICKS)
    return again.saved


@pytest.mark.parametrize(("world", "level"), LEVELS, ids=[level for _, level in LEVELS])
def test_it_lives_as_in_tensors_and_resumes_to_the_same_bits(db: Database, world: str, level: str) -> None:
    run = begin(db, world, level)
    saved = lived(db, run)
    assert same_bits(saved, in_tensors(db, run, TICKS)) == []
    assert int(saved.tally.choices[0, Choice.LEFT] + saved.tally.choices[0, Choice.RIGHT]) > 0
    assert metrics(db, run, -1, 10)
    pretrained = bool(registry.defaults(world)["pretrain"])
    assert (get_run(db, run).weights is not None) == pretrained
    assert bool(saved.state.rehearsal.steps[0] > 0) == pretrained
    assert get_run(db, run).status == "active"


def test_unsupervised_episodes_ask_nothing_and_resume(db: Database) -> None:
    run = begin(db, "absent-supervisor", supervised="random", time_limit=6)
    saved = lived(db, run)
    assert same_bits(saved, in_tensors(db, run, TICKS)) == []


def test_a_run_keeps_the_weights_that_it_began_with(db: Database) -> None:
    shipped = find(Wanted(registry.kind("side-effects"), 6, 6)).read_bytes()
    first, second = begin(db, "side-effects"), begin(db, "side-effects")
    assert get_run(db, first).weights == get_run(db, second).weights == digest(shipped)
    assert shelf.fetch(db, digest(shipped)) == shipped
    loaded = load(shipped, Wanted(registry.kind("side-effects"), 6, 6))
    born = in_tensors(db, first, 0).state
    assert torch.equal(born.learner.live[0], loaded)


def test_damaged_weights_stop_their_run_with_a_sentence(db: Database) -> None:
    run = begin(db, "side-effects")
    with db.write() as session:
        session.connection().exec_driver_sql("UPDATE weights SET blob = X'00'")
    with pytest.raises(NotFound, match="are not in the database, or are damaged"):
        alive(db, run)


def test_a_size_without_weights_is_refused_beside_its_field(db: Database) -> None:
    text = "#######\n#AXG  #\n#     #\n#     #\n#######\n"
    new = NewRun(world="side-effects", level_text=text)
    with pytest.raises(Invalid) as caught:
        start(db, new)
    ((field, said),) = caught.value.fields
    assert field == "config.pretrain"
    assert "parenting pretrain --world side-effects --size 5x7" in said
    assert start(db, new.model_copy(update={"config": {"pretrain": False}})).weights is None
