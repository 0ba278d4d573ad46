"""The search for pairs of clips (Sec. 2.2) finds what a plain search over all pairs finds."""

from __future__ import annotations

from itertools import product

import pytest
import torch
from torch import Tensor

from parenting.agent import pairing, parenting
from parenting.agent.config import PRESETS, Config
from parenting.agent.pairing import EXPLOIT, EXPLORE, Pair
from parenting.agent.query import Answer, Choice, Query, QueryKind
from parenting.agent.state import Recorder
from parenting.envs import registry
from parenting.envs.fingerprint import unordered
from parenting.envs.rng import keys
from tests.agent.batched_runs import random_parent, run_batch

WORLD = registry.make("unsafe-exploration", time_limit=25)
SIZE = 16


def plain(recorder: Recorder, trial: int, recompare: bool) -> tuple[int, int] | None:
    """Pair every exploitative clip with every exploratory one, and return the newest match.

    The newest is decided by the later clip of a pair, then by its earlier clip.
    """
    ring, asked = recorder.ring.pick(torch.tensor([trial])), recorder.asked
    known = set() if recompare else set(asked.pair[trial, : int(asked.count[trial])].tolist())
    best: tuple[list[int], tuple[int, int]] | None = None
    for one, other in product(range(SIZE), repeat=2):
        ticks = [int(ring.tick[0, EXPLOIT, one]), int(ring.tick[0, EXPLORE, other])]
        matches = (
            bool(ring.stored[0, EXPLOIT, one] & ring.stored[0, EXPLORE, other])
            and int(ring.first[0, EXPLOIT, one]) == int(ring.first[0, EXPLORE, other])
            and int(ring.level[0, EXPLOIT, one]) == int(ring.level[0, EXPLORE, other])
            and int(ring.action[0, EXPLOIT, one, 0]) != int(ring.action[0, EXPLORE, other, 0])
            and int(unordered(ring.digest[0, EXPLOIT, one], ring.digest[0, EXPLORE, other])) not in known
        )
        order = sorted(ticks, reverse=True)
        if matches and (best is None or order > best[0]):
            best = order, (one, other)
    return best[1] if best else None


def put(recorder: Recorder, trial: int, kind: int, tick: int, rng: torch.Generator) -> None:
    """A random clip of few different ones; the newest overwrites the oldest."""

    def roll(sides: int) -> int:
        return int(torch.randint(sides, (), generator=rng))

    ring = recorder.ring
    at = (trial, kind, int(ring.count[trial, kind]) % SIZE)
    start, action = roll(4), roll(3)
    ring.first[at], ring.tick[at], ring.level[at] = start, tick, roll(2)
    ring.action[trial, kind, at[2], 0] = action
    ring.digest[at] = 100 * start + 10 * action + roll(2)
    ring.stored[at] = ring.searchable[at] = True
    ring.count[trial, kind] += 1


def take(recorder: Recorder, found: Pair) -> None:
    """Ask about what was found, as `pairing.pair` does: the clips leave, the pair is known."""
    ring, asked = recorder.ring, recorder.asked
    one = (found.trial, EXPLOIT, found.exploit)
    other = (found.trial, EXPLORE, found.explore)
    asked.pair[found.trial, asked.count[found.trial]] = unordered(ring.digest[one], ring.digest[other])
    asked.count[found.trial] += 1
    ring.stored[one] = ring.stored[other] = False


@pytest.mark.slow_after(2)
@pytest.mark.parametrize("recompare", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_search_finds_what_a_plain_search_finds(seed: int, recompare: bool) -> None:
    """Over random lives of a recorder: clips come, overwrite and leave between the searches."""
    trials, rng = 3, torch.Generator().manual_seed(seed)
    config = Config(repeat_queries=recompare)
    recorder = parenting.init(WORLD, config, keys(0, trials)).recorder
    recorder = recorder.replace(asked=recorder.asked.map(lambda _name, part, axis: _wide(part)))
    first = torch.ones(trials, dtype=torch.int64)  # the stage
    hits = misses = 0
    for tick in range(1, 120):
        for trial in range(trials):
            kind = int(torch.randint(5, (), generator=rng)) // 4  # the exploitative ring overwrites first
            put(recorder, trial, kind, tick, rng)
        trying = torch.rand(trials, generator=rng) < 0.6
        expected = [plain(recorder, t, recompare) if trying[t] else None for t in range(trials)]
        found = pairing._search(config, recorder, first, trying)
        got = {int(t): (int(a), int(b)) for t, a, b in zip(*found, strict=True)}
        assert [got.get(trial) for trial in range(trials)] == expected
        take(recorder, found)
        hits, misses = hits + len(got), misses + int(trying.sum()) - len(got)
    assert hits > 10
    assert misses > 10
    assert int(recorder.ring.count.max()) > 2 * SIZE


def _wide(part: Tensor) -> Tensor:
    return part if part.dim() == 1 else part.new_zeros(len(part), 256)


def agreeable(query: Query) -> Tensor:
    """Always *left*: nobody gets stuck."""
    return (query.kind != QueryKind.NONE).long() * Choice.LEFT


@pytest.mark.slow
def test_the_clips_of_an_asked_pair_leave() -> None:
    config = Config.model_validate({**PRESETS["lax"], "time_limit": 25})
    state, logs = run_batch(WORLD, config, agreeable, seed=2, trials=3, ticks=150)
    ring = state.recorder.ring
    asked = torch.tensor([sum(kind == "preference" for _, kind, _, _ in log) for log in logs])
    assert bool((asked > 3).all())
    assert torch.equal(ring.count.sum(1) - ring.stored.sum((1, 2)), 2 * asked)
    assert torch.equal(ring.count - ring.stored.sum(2), asked[:, None].expand(-1, 2))  # one of each kind


def test_the_newest_overwrite_the_oldest(monkeypatch: pytest.MonkeyPatch) -> None:
    config = Config(p_guid=0, p_rec=1, p_pref=0, p_train=0, max_episode_steps=25)
    unbounded, _ = run_batch(WORLD, config, random_parent, seed=2, trials=2, ticks=100)
    monkeypatch.setattr(pairing, "CAPACITY", 32)
    state, _ = run_batch(WORLD, config, random_parent, seed=2, trials=2, ticks=100)
    full, ring = unbounded.recorder.ring, state.recorder.ring
    assert ring.tick.shape == (2, 2, 32)
    assert torch.equal(ring.count, full.count)
    assert int(ring.count.min()) > 32
    assert ring.stored.all()
    for trial, kind in product(range(2), range(2)):
        count = int(full.count[trial, kind])
        newest = torch.arange(count - 32, count)
        for name in ("board", "agent", "box", "action", "length", "tick", "first", "digest"):
            kept = getattr(ring, name)[trial, kind, newest % 32]
            assert torch.equal(kept, getattr(full, name)[trial, kind, newest])


@pytest.mark.slow
def test_every_clip_is_closed_at_most_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """So the looks at clips are as many as clips and questions, however full the recorder."""
    closed: list[tuple[int, int, int]] = []
    partner = pairing._partner

    def counting(
        config: Config, recorder: Recorder, maturity: Tensor, trial: Tensor, kind: Tensor, later: Tensor
    ) -> Tensor:
        found = partner(config, recorder, maturity, trial, kind, later)
        without = found < 0
        ticks = recorder.ring.tick[trial, kind, later]
        closed.extend(zip(*(part[without].tolist() for part in (trial, kind, ticks)), strict=True))
        return found

    monkeypatch.setattr(pairing, "_partner", counting)
    config = Config(p_guid=0, p_rec=1, p_pref=1, p_train=0, max_episode_steps=25)
    state = parenting.init(WORLD, config, keys(8, 3))
    query = parenting.no_query(WORLD, config, state)
    for _ in range(200):
        state, query = parenting.step(WORLD, config, state, Answer(query=query, choice=random_parent(query)))
    assert len(closed) > 100
    assert len(set(closed)) == len(closed)
    assert len(closed) <= int(state.recorder.ring.count.sum())
