"""Bit for bit means every bit; and the record is the same however much of it is read at once."""

from __future__ import annotations

import pytest
import torch

from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.queue.worker_side import watch
from parenting.server.replay import differences, equal, relive
from parenting.server.runs import claim, get_run
from parenting.server.session import RunSession
from parenting.server.snapshot import INFO, Snapshot
from tests.server.raising import ISLAND, inline


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ([1.0, 2.0], [1.0, 2.0], True),
        ([0.0], [-0.0], False),
        ([float("nan")], [float("nan")], True),
        ([1.0], [1.0 + 2**-23], False),
        ([1.0], [1.0, 1.0], False),
        ([[1.0], [2.0]], [[1.0, 2.0]], False),
        ([1], [1.0], False),
        (True, True, True),
        ([], [], True),
    ],
)
def test_equal_means_every_bit(one: object, other: object, same: bool) -> None:
    assert equal(torch.tensor(one), torch.tensor(other)) is same


def test_every_piece_is_held_against_its_own() -> None:
    """Each tensor alone, changed in its last bit or flag, is named alone."""
    kept = inline(30)

    def changed(name: str) -> Snapshot:
        def flip(this: str, part: torch.Tensor, _axis: int | None) -> torch.Tensor:
            if this != name:
                return part
            other = part.clone()
            other.reshape(-1).view(torch.uint8)[0] ^= 1
            return other

        return kept._replace(state=kept.state.map(flip), tally=kept.tally.map(flip))

    names = [name for name, part in kept.state.tensors().items() if part.numel()]
    names = [name for name in names if not name.startswith(INFO)]
    assert len(names) > 30
    assert [name for name in names if differences(changed(name), kept) != [name]] == []
    assert [differences(changed(name), kept) for name in ("deaths", "choices")] == [
        ["tally.deaths"],
        ["tally.choices"],
    ]
    other = kept._replace(config=kept.config.model_copy(update={"p_guid": 0.1}))
    assert differences(other, kept) == ["config"]


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("window", [1, 7, 1000])
def test_it_is_the_same_in_small_portions(db: Database, monkeypatch: pytest.MonkeyPatch, window: int) -> None:
    monkeypatch.setattr("parenting.server.reads.record.WINDOW", window)
    run = start(db, ISLAND.new("scripted")).id
    (mine,) = claim(db, "test")
    life = RunSession(db, mine, get_run(db, run), lambda: None)
    while life.last_tick < 30:
        life.tick(watch(db, [run])[run])
    life.save()
    seen: list[tuple[int, int]] = []
    found = relive(db, run, lambda tick, last: seen.append((tick, last)))
    assert found.equal
    assert (found.tick, found.checkpoint, found.events) == (30, 30, 0)
    assert found.answers > 5
    assert seen == [(tick, 30) for tick in range(1, 31)]
