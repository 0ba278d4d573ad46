"""What an agent is like on its way: its policy and its counts after so many answered queries."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from parenting.agent.config import Config
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Keys
from parenting.envs.struct import Struct
from parenting.experiments.training.batch import Nursery, Tally, Until, no_tally


class Passed(Struct):
    """All trials as they passed one milestone."""

    there: Bool[Tensor, "N"]  # it did come so far
    tally: Tally
    live: Float[Tensor, "N P"]  # pi_T


def raise_past(
    world: Gridworld,
    config: Config,
    keys: Keys,
    milestones: Sequence[int],
    max_ticks: int,
    weights: Tensor | None = None,
) -> list[Passed]:
    """Raise one agent for each of `keys` past every milestone, numbers of answered queries that grow.

    Trials that are not at the last one by `max_ticks`, or that are stuck, are not `there`.
    """
    nursery = Nursery(world, config, keys, Until("queries", milestones[-1]), weights)
    passed = [_none(nursery) for _ in milestones[:-1]]
    for _ in range(max_ticks):
        nursery.tick()
        answered = nursery.tally.queries.sum(1)
        for place, number in enumerate(milestones[:-1]):
            passed[place] = _note(nursery, passed[place], answered >= number)
        if bool(nursery.tally.done.all()):
            break
    nursery.save(~nursery.tally.done)
    ended = nursery.result.maturity - 1
    last = nursery.policies[ended, torch.arange(len(ended))]
    return [*passed, Passed(there=nursery.result.finished, tally=nursery.result, live=last)]


def _none(nursery: Nursery) -> Passed:
    live = torch.zeros_like(nursery.state.learner.live)
    tally = no_tally(len(live), nursery.config.stages)
    return Passed(there=torch.zeros(len(live), dtype=torch.bool), tally=tally, live=live)


def _note(nursery: Nursery, passed: Passed, beyond: Bool[Tensor, "n"]) -> Passed:
    """Those that are beyond the milestone for the first time, as they are now."""
    fresh = (beyond & ~passed.there[nursery.trial]).nonzero().squeeze(1)
    if not len(fresh):
        return passed
    place = nursery.trial[fresh]
    now = Passed(there=torch.ones_like(beyond), tally=nursery.tally, live=nursery.state.learner.live).pick(
        fresh
    )
    ours = now.tensors()
    return passed.map(lambda name, tensor, _axis: tensor.index_put((place,), ours[name]))
