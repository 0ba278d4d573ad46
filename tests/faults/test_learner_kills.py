"""A worker that is killed while it learns goes on with the same bits (C1): equal digests after every kill.

A scripted parent answers, so nothing but the kills differs from the same run in memory, which no process and
no database disturbs. After each kill the digest of the newest checkpoint is that of this run at its tick, and
so are the counts beside it.
"""

from __future__ import annotations

import hashlib
import random
import time

import pytest

from parenting.server.board.columns import unpack
from parenting.server.board.store import read_counts
from parenting.server.checkpoints import load_checkpoints
from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.runs import get_run
from parenting.server.settings import Settings
from parenting.server.snapshot import Snapshot
from tests.faults.figures import Figures
from tests.faults.house import PATCHES, PATIENCE, in_time
from tests.lengths import length
from tests.server.processes import Command, store_of
from tests.server.raising import CONFIG, ISLAND, Inline, last

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(1800, 20000))]
KILLS = {"sqlite": length(25, 5000), "postgresql": length(5, 500)}
SURE = ISLAND._replace(preset="frugal", changes={**CONFIG, "confirm": 0.95})
"""Remembers answers and refusals, trains on nine batches an answer, and asks again to be sure."""
SPREAD = 0.1
"""A kill comes up to so many seconds after a checkpoint that is newer than the kill before."""


def digest(saved: Snapshot) -> str:
    """All tensors of a run with its counts and its config, `info` excepted, as one hash."""
    found = hashlib.sha256(repr(saved.config).encode())
    for prefix, part in (("state", saved.state), ("tally", saved.tally)):
        for name, tensor in sorted(part.tensors().items()):
            if not name.startswith("info."):
                found.update(f"{prefix}.{name} {tensor.dtype} {tuple(tensor.shape)}".encode())
                found.update(tensor.contiguous().numpy().tobytes())
    return found.hexdigest()


def counted(db: Database, run: int, tick: int) -> tuple[int, int, int]:
    """The newest stored numbers of all states up to a tick: theirs, and the sums of visits and deaths."""
    row = read_counts(db, run, tick)
    assert row is not None
    columns = unpack(row.blob, row.states)
    visits, deaths = (sum(memoryview(columns[name]).cast("I")) for name in ("visits", "deaths"))
    return row.tick, visits, deaths


def until_newer(db: Database, run: int, tick: int, worker: Command) -> None:
    """Wait until there is a checkpoint of a later tick, or the run is over."""
    end = time.monotonic() + PATIENCE
    while not any(saved.tick > tick for saved in load_checkpoints(db, run)):
        in_time(end, lambda: f"no checkpoint after tick {tick}: {worker.said()}")
        assert worker.alive, worker.said()
        if get_run(db, run).reason is not None:
            return
        time.sleep(0.005)


def test_killed_learner_goes_on_with_the_same_bits(
    settings: Settings, store: str, db: Database, rng: random.Random, figures: Figures
) -> None:
    tick, moves, digests, run, begun, alone = 0, 0, set[str](), 0, ISLAND, Inline(ISLAND)
    for seed in range(KILLS[store]):
        if not run or get_run(db, run).reason is not None:  # it has learnt all; the next run has another seed
            begun = (SURE, ISLAND)[seed % 2]._replace(seed=seed + 1)
            run, alone, tick, moves = start(db, begun.new("scripted")).id, Inline(begun), 0, 0
        worker = Command("worker", data=settings.data, patches=PATCHES, environment=store_of(settings))
        until_newer(db, run, tick, worker)
        time.sleep(rng.uniform(0, SPREAD))
        worker.kill()
        saved = last(db, run, begun)
        tick = int(saved.state.keys.tick[0])
        while int(alone.saved.state.keys.tick[0]) < tick:
            alone.tick()
            moves += bool(alone.saved.state.info.moved[0])
        assert digest(saved) == digest(alone.saved), f"at tick {tick}"
        assert counted(db, run, tick) == (tick, moves, int(saved.tally.deaths[0]))
        digests.add(digest(saved))
        figures.count("SIGKILLs of a learner", f"{begun.preset}: digest equal")
    assert len(digests) > KILLS[store] // 2, "most kills were followed by progress"


def test_digest_tells_one_bit() -> None:
    one, other = Inline(ISLAND), Inline(ISLAND)
    for _ in range(5):
        one.tick()
        other.tick()
    assert digest(one.saved) == digest(other.saved)
    other.saved.state.learner.exp_avg.view(-1)[0] += 1e-7
    assert digest(one.saved) != digest(other.saved)
