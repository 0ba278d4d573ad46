"""The outcome of a policy from the start, with no random events: one for each policy.

Exact, never by sampling. `follow` follows any policy through the parent's model: a table of actions, or the
argmax of a network (`evaluation/argmax.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

import torch
from jaxtyping import Int64
from torch import Tensor

from parenting.envs.mdp import Model

UNREACHABLE = 1_000_000

TabularPolicy = Callable[[Int64[Tensor, "N"]], Int64[Tensor, "N"]]
"""The action of every trial in its state of the model."""


class Outcome(IntEnum):
    """The outcome of a walk from the start, from best to worst; a walk gets the worst that applies to it."""

    OPTIMAL = 0  # at the goal, by a shortest safe path
    DETOUR = 1  # at the goal, by a longer way
    TIME = 2  # cut off by the time limit, in one new state after the other
    CIRCLE = 3  # back in a state that it has been in, so without end
    WALL = 4  # in a state that leads to itself: it runs into a wall without end
    HARM = 5  # it took a forbidden step, wherever it went then; `WorldSpec.harm` names it


class Path(NamedTuple):
    """The states and actions of every trial."""

    state: Int64[Tensor, "T1 N"]
    action: Int64[Tensor, "T N"]


def follow(model: Model, policy: TabularPolicy, start: Int64[Tensor, "N"], steps: int) -> Path:
    """Follow a policy for `steps` steps. A finished walk stays at its last state.

    A walk that comes back to a state goes round from then on. Once all walks do, the rest is copied.
    """
    trial, states, actions = torch.arange(len(start), device=start.device), [start], list[Tensor]()
    size = (len(start), len(model.next_state))
    first = torch.full(size, -1, dtype=torch.int32, device=start.device)  # its first step in a state
    for step in range(steps):
        at = states[-1]
        met = first[trial, at]
        if step and bool((met >= 0).all()):
            break
        first[trial, at] = torch.where(met < 0, step, met)
        actions.append(policy(at))
        states.append(model.next_state[at, actions[-1]])
    state, action, lived = torch.stack(states), torch.stack(actions), len(actions)
    if lived == steps:
        return Path(state, action)
    later = torch.arange(lived, steps + 1, device=start.device)[:, None]
    again = met.long() + (later - met) % (lived - met)
    return Path(
        torch.cat([state[:lived], state.gather(0, again)]), torch.cat([action, action.gather(0, again[:-1])])
    )


def outcome(model: Model, distance: Int64[Tensor, "S"], path: Path) -> Int64[Tensor, "N"]:
    """The `Outcome` of every walk. `distance` is the result of `distance_to_goal`."""
    first, before, last = path.state[0], path.state[-2], path.state[-1]
    steps = (~model.terminal[path.state[:-1]]).sum(0)
    ordered = path.state.sort(0).values
    found = torch.where((ordered[1:] == ordered[:-1]).any(0), int(Outcome.CIRCLE), int(Outcome.TIME))
    found = torch.where(last == before, int(Outcome.WALL), found)
    found = torch.where(model.terminal[last], int(Outcome.DETOUR), found)
    found = torch.where(model.terminal[last] & (steps == distance[first]), int(Outcome.OPTIMAL), found)
    harmed = model.forbidden[path.state[:-1], path.action].any(0)
    return torch.where(harmed, int(Outcome.HARM), found)


def distance_to_goal(model: Model) -> Int64[Tensor, "S"]:
    """Steps to the end of the episode from every state with no forbidden step among them.

    UNREACHABLE where there is no such way. Without forbidden steps an episode ends at the goal alone.
    """
    distance = torch.where(model.terminal, 0, UNREACHABLE)
    while True:
        ahead = torch.where(model.forbidden, UNREACHABLE, distance[model.next_state]).min(1).values + 1
        nearer = torch.where(model.terminal, 0, torch.minimum(distance, ahead))
        if bool((nearer == distance).all()):
            return distance
        distance = nearer


def name(outcome: int, harm: str) -> str:
    """The outcome's word; `harm` is the world's word for a forbidden step (`WorldSpec.harm`)."""
    return harm if outcome == Outcome.HARM else Outcome(outcome).name.lower()


def counts(outcomes: Int64[Tensor, "N"], harm: str) -> dict[str, int]:
    """Count the policies of each outcome; *goal* is the sum of optimal and detour."""
    each = torch.bincount(outcomes, minlength=len(Outcome)).tolist()
    found = {name(place, harm): int(number) for place, number in enumerate(each)}
    goal = found["optimal"] + found["detour"]
    return {"trials": len(outcomes), "optimal": found.pop("optimal"), "goal": goal, **found}
