"""Bounds on the questions of an agent that carries nothing over from one state to another (ours).

*Decisions.* An optimal policy needs one decision in each state of one shortest safe way: an action that
brings the goal nearer. To be certain of a decision, the agent must have excluded the other three actions.
An answer *left*, *right* or *either* excludes one of them; *neither* excludes two, where two are unsafe.
`certain` adds these numbers up along the cheapest way. An agent may be optimal without being certain, so
this bounds certainty alone.

*Information.* Suppose that the agent cannot know in advance which action of a state is which: the four
actions of each state are relabelled at random. A fixed policy is optimal with the chance P = f(start),
where f(goal) = 1 and f(s) is a quarter of the sum of f over the states that optimal actions lead to. An
answer has at most four values, so after q answers an agent has had at most 1 + 4 + ... + 4^q = (4^(q+1) -
1) / 3 policies, each optimal with that chance. Hence it has been optimal within q answers with a chance of
at most P (4^(q+1) - 1) / 3, and the mean number of answers is at least the sum over q of 1 minus that
chance, as far as it is positive (`expected`).

A network generalises from state to state, and pre-training knows mazes: both may need fewer.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from parenting.envs.mdp import Model
from parenting.evaluation.outcomes import UNREACHABLE, distance_to_goal

ANSWERS = 4
"""*Left*, *right*, *either* and *neither*."""


def optimal_actions(model: Model, distance: Int64[Tensor, "S"]) -> Bool[Tensor, "S 4"]:
    """Return the safe actions that bring the goal nearer by one."""
    ahead = torch.where(model.forbidden, UNREACHABLE, distance[model.next_state])
    return (ahead == distance[:, None] - 1) & (distance[:, None] < UNREACHABLE)


def chance(model: Model, start: int) -> float:
    """Return P, the chance of a policy drawn uniformly to be optimal from a start."""
    distance = distance_to_goal(model)
    good = optimal_actions(model, distance)
    found = (distance == 0).double()
    for steps in range(1, int(distance[start]) + 1):
        of = (good * found[model.next_state]).sum(1) / good.shape[1]
        found = torch.where(distance == steps, of, found)
    return float(found[start])


def expected(model: Model, start: int) -> float:
    """Return the least mean number of answers until the policy is optimal, by information."""
    lucky, policies, total = chance(model, start), 1, 0.0
    while lucky * policies < 1:
        total += 1 - lucky * policies
        policies = ANSWERS * policies + 1
    return total


def certain(model: Model, start: int) -> int:
    """Return the least number of answers that make an agent certain of some shortest safe way."""
    distance = distance_to_goal(model)
    good = optimal_actions(model, distance)
    others = good.shape[1] - 1
    each = others - (model.unsafe.sum(1) >= 2).long()
    found = torch.where(distance == 0, 0, UNREACHABLE)
    for steps in range(1, int(distance[start]) + 1):
        rest = torch.where(good, found[model.next_state], UNREACHABLE).min(1).values
        found = torch.where(distance == steps, rest + each, found)
    return int(found[start])
