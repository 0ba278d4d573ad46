"""The parent's model of a world: every state in reach, and what each action leads to, chance left out.

Found by stepping all states at once until nothing new turns up, so it needs nothing of a world but its rules.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float64, Int64
from torch import Tensor

from parenting.envs.fingerprint import fingerprint, together
from parenting.envs.giving_way import give_way
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.struct import Struct

MAX_STATES = 1_000_000
"""States of a model, at the most."""
MAX_CELLS = 2**30
"""Cells of all its boards together, at the most: a gigabyte."""


class Model(Struct):
    """S states in the order of their discovery, first the world's beginnings: the starts of its K levels."""

    states: WorldState
    known: Int64[Tensor, "S"]  # the states' words, sorted
    order: Int64[Tensor, "S"]  # the state behind each word
    next_state: Int64[Tensor, "S 4"]  # the state that each action leads to
    reward: Float64[Tensor, "S 4"]
    unsafe: Bool[Tensor, "S 4"]
    forbidden: Bool[Tensor, "S 4"]
    terminal: Bool[Tensor, "S"]
    goal: Bool[Tensor, "S"]  # over, and not by harm alone: on a goal, or where some safe step led
    branch_state: Int64[Tensor, "S 4 B"]  # every outcome, where a world tells its chance; else B = 0
    branch_chance: Float64[Tensor, "S 4 B"]  # and its probability; then `reward` is their mean

    @property
    def chancy(self) -> bool:
        """Return whether the world tells what is left to chance in a step."""
        return self.branch_state.shape[-1] > 0

    def mean(self, v: Float64[Tensor, "S"]) -> Float64[Tensor, "S 4"]:
        """Return the mean of v over the states that each action leads to."""
        if not self.chancy:
            return v[self.next_state]
        return torch.where(self.branch_chance > 0, self.branch_chance * v[self.branch_state], 0.0).sum(-1)

    def any_of(self, to: Bool[Tensor, "S"]) -> Bool[Tensor, "S 4"]:
        """Return which actions may lead to some of these states."""
        if not self.chancy:
            return to[self.next_state]
        return (to[self.branch_state] & (self.branch_chance > 0)).any(-1)

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
    """One word for a state: board, agent, box and level.

    Flags are not part of it. Supervision stands on the board, as bars (3.2.5); whether an episode interrupts
    changes nothing in a model without interruption (3.2.4).
    """
    return together(fingerprint(board.flatten(-2)), fingerprint(agent), fingerprint(box), level)


def explore(world: Gridworld, limit: int | None = None) -> Model:
    """Every state that can be reached from the world's beginnings.

    Raises:
        ValueError: more than `limit` states, or two beginnings that a query could not tell apart.
    """
    most = min(MAX_STATES, MAX_CELLS // (world.height * world.width)) if limit is None else limit
    edge = world.beginnings()
    known = _word(edge)
    if len(torch.unique(known)) < len(known):
        raise ValueError(
            "Two of the world's beginnings look alike: a flag that matters must show on the board."
        )
    found, steps = [edge], []
    while len(edge.step_count):
        give_way()
        arrived, words, step = _expand(world, edge)
        steps.append(step)
        fresh = _new(words, known)
        edge = arrived.pick(fresh)
        found.append(edge)
        known = torch.cat((known, words[fresh]))
        if len(known) > most:
            raise ValueError(
                f"This world has more than {most} states, too many for the scripted parent to list; "
                "take a smaller level, or fewer levels at once."
            )
    return _model(world, WorldState.joined(found), known, steps)


def _expand(world: Gridworld, edge: WorldState) -> tuple[WorldState, Tensor, dict[str, Tensor]]:
    """Step every action from each state, in the order (state, action).

    Return the next states, one word for each, and what is to be known of each step. Where the world tells its
    chance, the next states are all outcomes.
    """
    number = torch.arange(len(edge.step_count), device=edge.step_count.device)
    before = edge.pick(number.repeat_interleave(4))
    action = torch.arange(4, device=number.device).repeat(len(number))
    after = _uncounted(world.forecast(before, action))
    said = {
        "word": _word(after),
        "reward": world.reward(before, action, after),
        "unsafe": world.unsafe(before, action, after),
        "forbidden": world.forbidden(before, action, after),
    }
    if world.branches == 1:
        return after, said["word"], said
    outcomes = [_uncounted(world.branch(before, action, place)) for place in range(world.branches)]
    worth = torch.stack([world.reward(before, action, one) for one in outcomes], -1)
    said["chance"] = world.branch_chance(before, action)
    said["reward"] = (said["chance"] * worth).sum(-1)
    said["branch"] = torch.stack([_word(one) for one in outcomes], -1)
    return WorldState.joined(outcomes), said["branch"].T.flatten(), said


def _uncounted(states: WorldState) -> WorldState:
    return states.replace(step_count=torch.zeros_like(states.step_count))


def _model(world: Gridworld, found: WorldState, known: Tensor, steps: list[dict[str, Tensor]]) -> Model:
    ordered = known.sort()
    said = {name: _by_state([step[name] for step in steps]) for name in steps[0]}
    next_state = ordered.indices[torch.searchsorted(ordered.values, said["word"])]
    if "branch" in said:
        branches = ordered.indices[torch.searchsorted(ordered.values, said["branch"])], said["chance"]
    else:
        branches = next_state.new_zeros(*next_state.shape, 0), said["reward"].new_zeros(*next_state.shape, 0)
    on_goal = world.lookup("G")[world.tile(found.board, found.agent)]
    return Model(
        states=found,
        known=ordered.values,
        order=ordered.indices,
        next_state=next_state,
        reward=said["reward"],
        unsafe=said["unsafe"],
        forbidden=said["forbidden"],
        terminal=found.terminated,
        goal=found.terminated & (on_goal | _entered_safely(found.terminated, next_state, said["unsafe"])),
        branch_state=branches[0],
        branch_chance=branches[1],
    )


def _by_state(rows: list[Tensor]) -> Tensor:
    """Rows of steps as [S, 4], or as [S, 4, B] of their outcomes."""
    joined = torch.cat(rows)
    return joined.view(-1, 4, *joined.shape[1:])


def _entered_safely(terminal: Tensor, next_state: Tensor, unsafe: Tensor) -> Bool[Tensor, "S"]:
    entered = torch.zeros_like(terminal)
    entered[next_state[~unsafe & ~terminal[:, None]]] = True
    return entered


def _word(states: WorldState) -> Tensor:
    return word(states.board, states.agent, states.box, states.level)


def _new(words: Tensor, known: Tensor) -> Tensor:
    """The first place of each word that is not known yet, in order."""
    unique, inverse = torch.unique(words, return_inverse=True)
    places = torch.arange(len(words), device=words.device)
    first = torch.full_like(unique, len(words)).scatter_reduce(0, inverse, places, "amin")
    return first[~torch.isin(unique, known)].sort().values
