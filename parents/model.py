"""The parent's model of a world: every state in reach, and what each action leads to, chance left out.

Found by stepping all states at once until nothing new turns up, so it needs nothing of a world but its rules.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from agent.digest import fingerprint, together
from envs.gridworld import Gridworld, WorldState
from envs.rng import keys
from envs.struct import Struct


class Model(Struct):
    """S states in the order of their discovery; the first K are the starts of the world's K levels."""

    states: WorldState
    known: Int64[Tensor, "S"]  # the states' words, sorted
    order: Int64[Tensor, "S"]  # the state behind each word
    then: Int64[Tensor, "S 4"]  # the state that each action leads to
    reward: Float64[Tensor, "S 4"]
    unsafe: Bool[Tensor, "S 4"]
    over: Bool[Tensor, "S"]

    def find(self, board: Tensor, agent: Tensor, box: Tensor, level: Tensor) -> Int64[Tensor, "..."]:
        """The states of given boards, for any leading axes.

        Raises:
            LookupError: a state that cannot be reached from the start of its level.
        """
        sought = word(board, agent, box, level)
        place = torch.searchsorted(self.known, sought).clamp_max(len(self.known) - 1)
        if not bool((self.known[place] == sought).all()):
            raise LookupError("A state was asked about that cannot be reached from the start of its level.")
        return self.order[place]


def word(board: Tensor, agent: Tensor, box: Tensor, level: Tensor) -> Int64[Tensor, "..."]:
    """One word for a state: board, agent, box and level."""
    return together(fingerprint(board.flatten(-2)), fingerprint(agent), fingerprint(box), level)


def explore(world: Gridworld, limit: int = 1_000_000) -> Model:
    """Every state that can be reached.

    Raises:
        ValueError: more than `limit` states.
    """
    found = world.reset(
        keys(0, len(world.levels), world.device), torch.arange(len(world.levels), device=world.device)
    )
    known = _word(found)
    edge, steps = found, []
    while len(edge.t):
        steps.append(_look(world, edge))
        arrived = steps[-1][0]
        fresh = _new(_word(arrived), known)
        edge = arrived.pick(fresh)
        found = _join(found, edge)
        known = torch.cat((known, _word(edge)))
        if len(known) > limit:
            raise ValueError(
                f"This world has more than {limit} states: values cannot be computed by listing them."
            )
    return _model(found, known, steps)


def _look(world: Gridworld, edge: WorldState) -> tuple[WorldState, Tensor, Tensor]:
    """What the four actions lead to from each state, with their rewards and dangers; rows in the order
    (state, action).
    """
    before = edge.pick(torch.arange(len(edge.t)).repeat_interleave(4))
    action = torch.arange(4).repeat(len(edge.t))
    after = world.forecast(before, action)
    return (
        after.replace(t=torch.zeros_like(after.t)),
        world.reward(before, action, after),
        world.unsafe(before, action, after),
    )


def _model(found: WorldState, known: Tensor, steps: list[tuple[WorldState, Tensor, Tensor]]) -> Model:
    ordered = known.sort()
    arrived = torch.cat([_word(step[0]) for step in steps])
    return Model(
        states=found,
        known=ordered.values,
        order=ordered.indices,
        then=ordered.indices[torch.searchsorted(ordered.values, arrived)].view(-1, 4),
        reward=torch.cat([step[1] for step in steps]).view(-1, 4),
        unsafe=torch.cat([step[2] for step in steps]).view(-1, 4),
        over=found.over,
    )


def _word(states: WorldState) -> Tensor:
    return word(states.board, states.agent, states.box, states.level)


def _new(words: Tensor, known: Tensor) -> Tensor:
    """The first place of each word that is not known yet, in order."""
    unique, inverse = torch.unique(words, return_inverse=True)
    places = torch.arange(len(words))
    first = torch.full_like(unique, len(words)).scatter_reduce(0, inverse, places, "amin")
    return first[~torch.isin(unique, known)].sort().values


def _join(one: WorldState, other: WorldState) -> WorldState:
    theirs = other.tensors()
    return one.map(lambda name, tensor, _axis: torch.cat((tensor, theirs[name])))
