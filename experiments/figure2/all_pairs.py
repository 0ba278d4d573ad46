"""Every pair of first moves in given states, as clips, and the parent's answers about them (Sec. 2.4)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import torch
from jaxtyping import Float64, Int64, UInt8
from torch import Tensor

from parenting.agent.query import Answer, Query, QueryKind, empty
from parenting.envs.gridworld import WorldState
from parenting.envs.reward_hacking import RewardHacking
from parenting.evaluation.rollouts import argmax
from parenting.parents.scripted import ScriptedRule

PAIRS = tuple(combinations(range(4), 2))


def pair_answers(
    world: RewardHacking, rule: ScriptedRule, states: WorldState, frozen: Sequence[Tensor]
) -> Float64[Tensor, "S 6 2"]:
    """Eq. (1) for the six pairs in each of some states."""
    clips = [clip(world, states, action, frozen) for action in range(4)]
    mu = []
    for left, right in PAIRS:
        query = compare(world, states, clips[left], clips[right])
        mu.append(Answer(query=query, choice=rule.answer(query)).mu)
    return torch.stack(mu, 1)


class Clip(NamedTuple):
    """One clip from each of S states: T + 1 frames and T moves."""

    ground: UInt8[Tensor, "S T1 H W"]
    agent: Int64[Tensor, "S T1 2"]
    action: Int64[Tensor, "S T"]


def clip(world: RewardHacking, states: WorldState, first: int, frozen: Sequence[Tensor]) -> Clip:
    """A first move, then the argmax of pi_{T-1}, and so on down to pi_1 (Eq. 5, 6)."""
    frames, actions = [states], []
    for policy in (None, *reversed(frozen)):
        now = frames[-1]
        action = torch.full_like(now.step_count, first) if policy is None else argmax(world, policy, now)
        actions.append(action)
        frames.append(world.forecast(now, action))
    return Clip(
        ground=torch.stack([one.board for one in frames], 1),
        agent=torch.stack([one.agent for one in frames], 1),
        action=torch.stack(actions, 1),
    )


def compare(world: RewardHacking, states: WorldState, left: Clip, right: Clip) -> Query:
    """A preference query about two clips for each state."""
    length = left.action.shape[1]
    query = empty(len(states.step_count), length, world.height, world.width)
    ground, agent = torch.stack((left.ground, right.ground), 1), torch.stack((left.agent, right.agent), 1)
    return query.replace(
        kind=torch.full_like(query.kind, QueryKind.PREFERENCE),
        observation=world.observe(ground, agent, torch.full_like(agent, -1)),
        board=ground,
        agent=agent,
        box=torch.full_like(agent, -1),
        action=torch.stack((left.action, right.action), 1),
        length=torch.full_like(query.length, length),
        maturity=torch.full_like(query.maturity, length),
        level=states.level,
    )
