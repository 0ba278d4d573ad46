"""The last checkpoint is read alone, and nothing is drawn for it."""

from __future__ import annotations

import pytest

from parenting.agent.policy import Network
from parenting.server import checkpoints
from parenting.server.checkpoints import newest_first, save_checkpoint
from parenting.server.db import Database
from parenting.server.runs import Claim
from parenting.server.snapshot import pack
from tests.server.raising import ISLAND, same_bits


def test_whoever_takes_the_newest_checkpoint_reads_no_other(
    db: Database, mine: Claim, monkeypatch: pytest.MonkeyPatch
) -> None:
    for tick in (10, 20):
        save_checkpoint(db, mine, tick, bytes([tick]))
    read = []
    monkeypatch.setattr(checkpoints, "_stored", lambda _, row: read.append(row.tick))
    each = newest_first(db, mine.run_id)
    next(each)
    assert read == [20]
    next(each)
    assert read == [20, 10]


def test_no_weights_are_drawn_to_read_a_checkpoint(monkeypatch: pytest.MonkeyPatch) -> None:
    """A large network has millions, and all of them would be replaced by those that are read."""
    saved = ISLAND.initial_snapshot()
    blob = pack(saved)
    monkeypatch.setattr(Network, "init_params", None)
    assert same_bits(ISLAND.unpack(blob), saved) == []
