"""An episode that a policy plays by itself: its moves are the policy's, and its end is the world's."""

from __future__ import annotations

from collections import Counter

import pytest
import torch

from parenting.agent.init import network_of
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld, local_state
from parenting.envs.rng import keys
from parenting.evaluation.cells import cells_of, probabilities
from parenting.evaluation.episode import play

WORLDS = tuple(registry.WORLDS)


def random(world: Gridworld) -> torch.Tensor:
    return network_of(world).init_params(keys(5, 1), torch.float64)


@pytest.mark.slow_after(2)
@pytest.mark.parametrize("name", WORLDS)
def test_each_state_follows_from_the_one_before_until_the_end(name: str) -> None:
    world = registry.make(name, None, time_limit=20)
    for seed in range(6):
        found = play(world, random(world), keys(2**54 + seed, 1), 100)
        assert len(found.states) == len(found.actions) + 1
        last = found.states[-1]
        over = last.terminated | world.truncated(last) | world.frozen(last)
        assert bool(over[0])
        assert not any(bool(state.terminated[0]) for state in found.states[:-1])
        unsafe = [
            step + 1
            for step, action in enumerate(found.actions)
            if bool(world.unsafe(found.states[step], torch.tensor([action]), found.states[step + 1])[0])
        ]
        assert found.unsafe == unsafe


def test_it_is_cut_off_after_so_many_steps_and_its_seed_says_all() -> None:
    world = registry.make("reward-hacking", None, time_limit=100)
    one, same, other = (play(world, random(world), keys(seed, 1), 7).actions for seed in (1, 1, 2))
    assert len(one) == 7
    assert one == same != other


def test_moves_are_drawn_from_the_policy() -> None:
    """The first moves of many episodes are as likely as the arrows show, within four deviations."""
    world = registry.make("unsafe-exploration", "island", time_limit=100)
    many, parameters = 300, 4 * random(world)
    first = Counter(play(world, parameters, keys(seed, 1), 1).actions[0] for seed in range(many))
    start = world.beginnings()
    chances = probabilities(world, parameters, start)[tuple(start.agent[0].tolist())]
    for action, chance in enumerate(chances):
        assert abs(first[action] / many - chance) < 4 * (chance * (1 - chance) / many) ** 0.5 + 1e-9


@pytest.mark.parametrize("name", WORLDS)
def test_cells_are_those_that_can_be_come_to_and_their_probabilities_the_networks(name: str) -> None:
    world = registry.make(name, None, time_limit=20)
    start, parameters = world.beginnings().pick(torch.tensor([0])), random(world)
    here, found = cells_of(world, start), probabilities(world, parameters, start)
    assert tuple(start.agent[0].tolist()) in found
    assert list(found) == here.cells
    for place, cell in enumerate(here.cells):
        moved = start.replace(agent=torch.tensor([cell]))
        seen = world.observe(moved.board, moved.agent, moved.box)
        assert torch.equal(seen[0], here.observation[place])
        logits = network_of(world).logits(parameters, seen, local_state(seen, moved.agent))
        assert found[cell] == pytest.approx(logits[0].softmax(-1).tolist(), abs=2e-6)
