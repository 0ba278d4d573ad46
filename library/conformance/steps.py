"""Properties of reset and step."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import torch
from torch import Tensor

from parenting.envs import registry
from parenting.envs.levels.spec import AGENT
from parenting.envs.rng import keys
from parenting.envs.tables.text import KEY
from parenting.library.conformance.walks import Subject, begin, roll, same


def shapes_dtypes_and_codes(of: Subject) -> None:
    """States, flags and rewards have their declared shapes and types; rewards are finite."""
    world = of.make()
    for state, action in roll(world, trials=3, steps=20):
        state.check()
        of.hold(state.board.shape == (3, world.height, world.width), "board: its shape is not [N, H, W]")
        of.hold(int(state.board.max()) < len(world.legend), "board: a code is not in the legend")
        of.hold(world.code(AGENT) not in state.board, "board: it holds the agent, which stands beside it")
        after = world.forecast(state, action).check()
        for flag in (world.frozen(state), world.supervised(state), world.truncated(state)):
            of.hold((flag.dtype, flag.shape) == (torch.bool, (3,)), "frozen, supervised: wanted are bool [N]")
        for said in (world.unsafe(state, action, after), world.forbidden(state, action, after)):
            of.hold((said.dtype, said.shape) == (torch.bool, (3,)), "unsafe, forbidden: wanted are bool [N]")
        for name in ("reward", "suite_reward", "hidden_reward"):
            value = getattr(world, name)(state, action, after)
            of.hold((value.dtype, value.shape) == (torch.float64, (3,)), f"{name}: wanted are float64 [N]")
            of.hold(bool(value.isfinite().all()), f"{name}: it is not finite")


def a_batch_is_its_trials_one_by_one(of: Subject) -> None:
    """A trial lives the same alone and among others."""
    world = of.make()
    together = roll(world, trials=5, steps=40)
    for trial in range(5):
        one = torch.tensor([trial])
        key = keys(0, 5).pick(one)
        state = world.reset(key, torch.zeros(1, dtype=torch.int64))
        for batch, action in together:
            of.hold(same(state, batch.pick(one)), f"step: trial {trial} lives differently alone")
            key = key.next()
            state = world.step(state, action[one], key)


def nothing_is_changed_in_place(of: Subject) -> None:
    """No rule writes into what it is given."""
    world = of.make()
    state, key = begin(world, trials=4)
    for _ in range(30):
        action = torch.arange(4)
        copy = state.clone()
        after = world.step(state, action, key)
        world.forecast(state, action)
        world.observe(state.board, state.agent, state.box)
        world.reward(state, action, after)
        of.hold(same(state, copy), "a rule changes the state that it is given; use state.replace")
        of.hold(action.tolist() == [0, 1, 2, 3], "a rule changes the actions that it is given")
        state, key = after, key.next()
    again = begin(of.make(), trials=4)[0]
    of.hold(same(begin(world, trials=4)[0], again), "an episode changes how later ones begin")


def over_stays_over(of: Subject) -> None:
    """A step after the end changes nothing and earns nothing, wherever an operator ended the episode."""
    world = of.make()
    for state, action in roll(world, trials=4, steps=10):
        ended = state.replace(terminated=torch.ones_like(state.terminated))
        after = world.step(ended, action, keys(1, 4))
        of.hold(same(after, ended), "step: it changes a state whose episode is over")
        for name in ("reward", "suite_reward", "hidden_reward"):
            earned = getattr(world, name)(ended, action, after)
            of.hold(earned.tolist() == [0.0] * 4, f"{name}: it is not 0 after the end")
        of.hold(not world.unsafe(ended, action, after).any(), "unsafe: it holds after the end")
        of.hold(not world.truncated(after).any(), "truncated: it holds after the end")


def every_living_step_counts(of: Subject) -> None:
    """`step_count` grows by one a step, the level stays, and the agent stays on the board."""
    world = of.make()
    size = torch.tensor([world.height, world.width])
    for (before, _), (after, _) in pairwise(roll(world, trials=4, steps=30)):
        counted = torch.equal(after.step_count, before.step_count + ~before.terminated)
        of.hold(counted, "step_count: it must grow by one in each step before the end")
        of.hold(torch.equal(after.level, before.level), "level: a step changes it")
        inside = (after.agent >= 0) & (after.agent < size)
        of.hold(bool(inside.all()), "agent: a step leads off the board")


def no_rule_reads_the_step_count(of: Subject) -> None:
    """The parent's model, and what Gymnasium's environments remember, take this for granted."""
    world, key = of.make(), keys(1, 4)
    for early, action in roll(world, trials=4, steps=30):
        late = early.replace(step_count=early.step_count + 1000)
        after, other = world.step(early, action, key), world.step(late, action, key)
        of.hold(same(after, other.replace(step_count=after.step_count)), "step: it reads step_count")
        for name in ("reward", "suite_reward", "hidden_reward", "unsafe", "forbidden"):
            said = getattr(world, name)
            alike = torch.equal(said(early, action, after), said(late, action, other))
            of.hold(alike, f"{name}: it reads step_count")


def the_forecast_is_the_step_where_nothing_is_left_to_chance(of: Subject) -> None:
    """`step` does what `forecast` says wherever `likelihood` is 1."""
    world = of.make_certain()
    for (state, action), (after, _) in pairwise(roll(world, trials=8, steps=50)):
        ahead, chance = world.forecast(state, action), world.likelihood(state, action)
        of.hold(bool(((chance > 0) & (chance <= 1)).all()), "likelihood: it must be above 0 and at most 1")
        sure = chance == 1
        alike = same(ahead.pick(sure), after.pick(sure))
        of.hold(
            alike,
            "forecast: step does something else; give certain=, the options without chance",
        )


def the_same_keys_give_the_same_life(of: Subject, seed: int, actions: list[int]) -> None:
    """Chance is drawn by key: the same seed and actions give the same life."""
    world = registry.make(of.world)
    lives = []
    for _ in range(2):
        state, key = begin(world, trials=2, seed=seed)
        for action in actions:
            key = key.next()
            state = world.step(state, torch.full((2,), action), key)
        lives.append(state)
    of.hold(same(*lives), "step: the same keys do not give the same life; draw by key, not from torch")


def levels_of_one_size_live_in_one_batch(of: Subject) -> None:
    """Levels raised together live as each does alone. The levels of a table differ in their start alone."""
    if KEY in of.spec.keys:
        return
    first = registry.level(of.world)
    mirrored = replace(first, name="mirrored", rows=tuple(row[::-1] for row in first.rows))
    both = registry.make(of.world, [first, mirrored], **of.certain)
    state, key = begin(both, trials=4)
    of.hold(state.level.tolist() == [0, 1, 0, 1], "reset: the levels are not those that were asked for")
    alone = [registry.make(of.world, one, **of.certain) for one in (first, mirrored)]
    singles = [world.reset(key.pick(torch.tensor([i])), torch.tensor([0])) for i, world in enumerate(alone)]
    for action in [1, 2, 1, 3, 0, 1, 1, 2]:
        state = both.step(state, torch.full((4,), action), key)
        singles = [w.step(s, torch.tensor([action]), key) for w, s in zip(alone, singles, strict=True)]
        for trial, single in enumerate(singles * 2):
            for field in ("board", "agent", "box", "terminated"):
                alike = torch.equal(getattr(state, field)[trial], getattr(single, field)[0])
                of.hold(alike, f"{field}: on two levels at once it is another one than on each alone")


def random_actions(seed: int, steps: int) -> list[int]:
    """Return actions drawn at random."""
    drawn: Tensor = torch.randint(4, (steps,), generator=torch.Generator().manual_seed(seed))
    return [int(action) for action in drawn]
