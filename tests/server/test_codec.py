"""A query that is written down and read back is the same, bit for bit, in every world."""

from __future__ import annotations

import json

import pytest
import torch

from parenting.agent.query import Query
from parenting.envs import registry
from parenting.server.codec import decode, encode, kind_name
from parenting.server.replay import equal
from tests.server.raising import Begun, Inline

CONFIG = {"stages": 2, "mature_every": 3, "time_limit": 12, "p_guid": 0.3, "p_rec": 0.9, "p_pref": 0.9}
TICKS = 60


def asked(begun: Begun) -> list[Query]:
    """The queries that an agent asks in its first ticks."""
    run, found = Inline(begun), []
    for _ in range(TICKS):
        run.tick()
        if kind_name(run.query) is not None:
            found.append(run.query.map(lambda _name, part, _axis: part.clone()))
    return found


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("world", registry.WORLDS)
def test_it_comes_back_bit_for_bit(world: str) -> None:
    begun = Begun(world, next(iter(registry.spec(world).levels)), CONFIG)
    queries = asked(begun)
    assert {kind_name(query) for query in queries} == {"guidance", "preference"}
    for query in queries:
        name, stored = kind_name(query), json.loads(json.dumps(encode(begun.make(), query)))
        assert name is not None
        back = decode(begun.make(), 2, name, int(query.maturity[0]), stored).tensors()
        assert [part for part, tensor in query.tensors().items() if not equal(tensor, back[part])] == []


def test_another_level_than_the_runs_own_is_refused() -> None:
    begun = Begun("unsafe-exploration", "island", CONFIG)
    query = asked(begun)[0]
    with pytest.raises(ValueError, match=r"^level: 1 cannot be stored; a stored run has one level, 0\.$"):
        encode(begun.make(), query.replace(level=torch.ones_like(query.level)))
