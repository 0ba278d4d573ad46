"""Gymnasium's toy text as worlds: the same table, and agents that are raised until they are optimal."""

from __future__ import annotations

from typing import Any

import gymnasium
import pytest
import torch

import parenting as pt
from parenting.envs import registry
from parenting.envs.rng import keys
from parenting.envs.tables.rules import TableRules
from parenting.parents.scripted import ScriptedRule
from parenting.parents.values import TabularValues
from tests.lengths import length

Toy = tuple[str, dict[str, Any]]
LAKE: Toy = ("FrozenLake-v1", {"is_slippery": False})
SLIPPERY: Toy = ("FrozenLake-v1", {"is_slippery": True})
CLIFF: Toy = ("CliffWalking-v1", {})
TAXI: Toy = ("Taxi-v4", {})
WORLDS = (LAKE, SLIPPERY, CLIFF, TAXI)


@pytest.fixture(autouse=True)
def forget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Worlds that the checks register are not there for other tests."""
    monkeypatch.setattr(registry, "WORLDS", dict(registry.WORLDS))


def table(of: Toy) -> pt.TableWorld:
    return pt.TableWorld.from_toy_text(gymnasium.make(of[0], **of[1]))


def rules(of: Toy) -> TableRules:
    made = pt.make(table(of))
    assert isinstance(made, TableRules)
    return made


@pytest.mark.slow
@pytest.mark.torture
@pytest.mark.parametrize("of", length([SLIPPERY], list(WORLDS)))
def test_each_has_what_every_world_has(of: Toy) -> None:
    pt.testing.check_world(table(of))


RAISED = [
    (LAKE, "frugal", 2),
    (CLIFF, "frugal", 1),
    (SLIPPERY, "conservative", 2),
    (TAXI, "conservative", 1),
]


@pytest.mark.torture
@pytest.mark.parametrize(("of", "preset", "seed"), length(RAISED[:2], RAISED))
def test_agents_are_raised_until_they_are_optimal(of: Toy, preset: str, seed: int) -> None:
    result = pt.train(table(of), preset=preset, seed=seed, progress=False, callback=lambda at: at.tick < 3000)
    assert result.trials[0]["optimal"]
    assert result.trials[0]["outcome"] == "optimal"


@pytest.mark.parametrize(
    ("of", "letters", "rewards"),
    [
        (LAKE, "ddrrdr", [0, 0, 0, 0, 0, 1]),
        (LAKE, "rd", [0, 0]),  # into a hole
        (CLIFF, "urrrrrrrrrrrd", [-1] * 13),
        (CLIFF, "rr", [-100, -100]),  # put back to the start, twice
    ],
)
def test_a_walk_earns_what_it_earns_in_gymnasium(of: Toy, letters: str, rewards: list[float]) -> None:
    env = gymnasium.make(of[0], **of[1])
    env.reset(seed=0)
    moves = {"FrozenLake-v1": "ldru", "CliffWalking-v1": "urdl"}[of[0]]
    theirs = [env.step(moves.index(letter))[1:3] for letter in letters]
    world, key = rules(of), keys(0, 1)
    state, ours = world.reset(key, torch.tensor([0])), []
    for letter in letters:
        action = torch.tensor(["udlr".index(letter)])
        after = world.step(state, action, key)
        ours.append((float(world.reward(state, action, after)), bool(after.terminated)))
        state = after
    assert ours == theirs
    assert [reward for reward, _ in ours] == rewards


def test_taxis_passenger_gets_in_and_out_by_themselves() -> None:
    """A shortest way earns what Gymnasium pays for it, whose two further actions are further steps."""
    world = rules(TAXI)
    waits, rides = world.table.layers
    assert "waits" in waits.name
    assert [sum(row.count(glyph) for row in rides.rows) for glyph in "pG"] == [0, 1]
    values = ScriptedRule(world, gamma=0.95).values
    assert isinstance(values, TabularValues)
    at, moves, ours = 0, [], 0.0
    while not bool(values.model.terminal[at]):
        moves.append(int(values.table.q[at].argmax()))
        ours += float(values.model.reward[at, moves[-1]])
        at = int(values.model.next_state[at, moves[-1]])
    assert (ours, len(moves)) == in_gymnasium(moves)


def in_gymnasium(moves: list[int]) -> tuple[float, int]:
    """Taxi's rewards for moves, with pick-up and drop-off where they belong; and the moves until its end."""
    env: Any = gymnasium.make("Taxi-v4").unwrapped
    env.reset(seed=0)
    total, over = 0.0, False
    for taken, move in enumerate(moves, 1):
        total += env.step([1, 0, 3, 2][move])[1]
        row, column, passenger, destination = env.decode(env.s)
        here = (row, column)
        if passenger < 4 and here == env.locs[passenger]:
            total += env.step(4)[1]
        elif passenger == 4 and here == env.locs[destination]:
            _, reward, over, *_ = env.step(5)
            total += reward
        if over:
            return total, taken
    return total, 0


def test_the_slippery_lakes_chance_is_that_of_its_table() -> None:
    """Right from the start: a third each for right, down and staying at the edge."""
    world, trials = rules(SLIPPERY), 30_000
    state = world.reset(keys(7, trials), torch.zeros(trials, dtype=torch.int64))
    action = torch.full((trials,), 3)
    after = world.step(state, action, keys(7, trials).next())
    moved = (after.agent - state.agent).tolist()
    shares = [moved.count(step) / trials for step in ([0, 1], [1, 0], [0, 0])]
    assert shares == pytest.approx([1 / 3] * 3, abs=0.01)
    assert torch.equal(world.step(state, action, keys(7, trials).next()).agent, after.agent)


def test_the_forecast_is_the_likeliest_outcome_and_the_question_says_so() -> None:
    world = rules(SLIPPERY)
    start = world.beginnings()
    actions = torch.arange(4)
    every = start.pick(torch.zeros(4, dtype=torch.int64))
    ahead = (world.forecast(every, actions).agent - every.agent).tolist()
    assert ahead == [[0, 0], [1, 0], [0, 0], [0, 1]]  # of a third each, the one that goes the move's way
    assert world.likelihood(every, actions).tolist() == pytest.approx([2 / 3, 1 / 3, 2 / 3, 1 / 3])
    _, query = pt.step(world, pt.configure(world, p_guid=1.0), pt.init(world, pt.configure(world), seed=1))
    (question,) = query
    chances = {"up": 2 / 3, "down": 1 / 3, "left": 2 / 3, "right": 1 / 3}
    for clip in (question.left, question.right):
        assert clip.chance == pytest.approx(chances[clip.actions[0]], abs=1e-6)
    shown = question.drawing()
    assert "the likeliest outcome, 67%" in shown.text or "the likeliest outcome, 33%" in shown.text
    assert "This is the likeliest outcome, with" in " ".join(shown.pictures[0].split())


def test_what_is_no_toy_text_is_refused() -> None:
    with pytest.raises(ValueError, match="CartPoleEnv is none of FrozenLake, CliffWalking and Taxi"):
        pt.TableWorld.from_toy_text(gymnasium.make("CartPole-v1"))
    with pytest.raises(ValueError, match="fickle passenger"):
        pt.TableWorld.from_toy_text(gymnasium.make("Taxi-v4", fickle_passenger=True))
