"""Trials are stacked, and know nothing of each other, nor of any reward."""

from __future__ import annotations

from functools import partial

import pytest
import torch

from parenting.agent import parenting
from parenting.agent.config import PRESETS, Config
from parenting.agent.query import Answer, QueryKind
from parenting.agent.state import AgentState
from parenting.envs import registry
from parenting.envs.rng import Keys, Stream, keys
from tests.agent.batched_runs import LogEntry, clip, random_parent, run_batch

WORLD = registry.make("unsafe-exploration", time_limit=25)
CONFIG = Config.model_validate(
    {**PRESETS["lax"], "stages": 2, "mature_every": 12, "batch": 3, "time_limit": 25, "dtype": "float64"}
)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lax", "direct"])
def test_the_agent_reads_no_reward(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def secret(which: str, *_arguments: object) -> None:
        raise AssertionError(f"the agent read {which}")

    for which in ("reward", "unsafe", "suite_reward", "hidden_reward"):
        monkeypatch.setattr(type(WORLD), which, partial(secret, which))
    with pytest.raises(AssertionError, match="the agent read reward"):
        WORLD.reward(None, None, None)  # type: ignore[arg-type]
    config = Config.model_validate({**PRESETS[name], "time_limit": 25})
    state, logs = run_batch(WORLD, config, random_parent, seed=3, trials=2, ticks=200)
    assert all(logs)
    assert bool((state.learner.steps > 0).all())


def life(births: Keys, ticks: int) -> tuple[AgentState, list[list[LogEntry]]]:
    state = parenting.init(WORLD, CONFIG, births)
    query = parenting.no_query(WORLD, CONFIG, state)
    logs: list[list[LogEntry]] = [[] for _ in births.seed]
    for tick in range(1, ticks + 1):
        state, query = parenting.step(WORLD, CONFIG, state, Answer(query=query, choice=random_parent(query)))
        for trial in (query.kind != QueryKind.NONE).nonzero().squeeze(1).tolist():
            kind = QueryKind(int(query.kind[trial])).name
            logs[trial].append((tick, kind, clip(query, trial, 0), clip(query, trial, 1)))
    return state, logs


def test_a_trial_does_not_depend_on_its_neighbours() -> None:
    births = keys(11, 8)
    together, logs = life(births, ticks=150)
    assert len({str(log) for log in logs}) == 8  # eight different lives
    assert len(set(together.learner.steps.tolist())) > 1
    for trial in range(8):
        alone, (log,) = life(births.pick(torch.tensor([trial])), ticks=150)
        assert log == logs[trial]
        for name in ("params", "exp_avg", "exp_avg_sq"):
            ours, theirs = getattr(together.learner, name)[trial], getattr(alone.learner, name)[0]
            torch.testing.assert_close(ours, theirs, rtol=1e-9, atol=1e-12)
        torch.testing.assert_close(together.learner.frozen[:, trial], alone.learner.frozen[:, 0])


def test_a_draw_is_the_same_however_many_are_asked_for() -> None:
    births = keys(5, 3).next()
    every = births.uniform(Stream.MAZE, 4, 6).flatten(1)
    assert torch.equal(births.at(Stream.MAZE, torch.arange(24)), every)
    places = torch.tensor([17, 0, 5])
    assert torch.equal(births.at(Stream.MAZE, places), every[:, places])
    assert len(set(every.flatten().tolist())) == every.numel()
    assert not torch.equal(every, births.next().uniform(Stream.MAZE, 4, 6).flatten(1))
    assert not torch.equal(every, births.uniform(Stream.DRYING, 4, 6).flatten(1))


@pytest.mark.parametrize("stream", [stream for stream in Stream if stream < Stream.WEIGHTS])
def test_a_draw_is_the_same_by_itself_and_together_with_others(stream: Stream) -> None:
    births = keys(5, 3).next()
    places = torch.arange(6)
    for size in (1, 4, 6):
        assert torch.equal(births.uniform(stream, size), births.at(stream, places)[:, :size])
    assert torch.equal(births.uniform(stream), births.at(stream, places)[:, 0])


@pytest.mark.parametrize("trials", [2, 7, 100])
def test_a_trials_keys_do_not_depend_on_their_number(trials: int) -> None:
    few, many = keys(9, 2), keys(9, trials)
    assert torch.equal(few.seed, many.seed[:2])
    assert torch.equal(few.uniform(Stream.ACT, 4), many.uniform(Stream.ACT, 4)[:2])
    assert not torch.equal(few.seed, keys(10, 2).seed)
