"""Small worlds, plain parents and policies that say the same everywhere, for the tests of the reference."""

from collections.abc import Callable

import torch
from torch import Tensor, nn

from parenting.agent.config import Config
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from reference.clips import Clip, Recorded
from reference.parenting import Reference
from reference.policy import Policy

ISLAND = "WWWWW\nWA GW\nWWWWW\n"
ROOM = "#####\n#A G#\n#####\n"  # its agent can only walk, or stop at a wall
UP, DOWN, LEFT, RIGHT = range(4)
EVEN = (0.0, 0.0, 0.0, 0.0)


def world(*texts: str, time_limit: int = 100) -> Gridworld:
    levels = [registry.level("unsafe-exploration", text) for text in texts]
    return registry.make("unsafe-exploration", levels, time_limit=time_limit)


def bias(head: nn.Sequential) -> Tensor:
    """A head's last biases."""
    found = head[-1].bias
    assert isinstance(found, Tensor)
    return found


def set_logits(policy: Policy, near: tuple[float, ...] = EVEN, far: tuple[float, ...] = EVEN) -> None:
    """Heads that say the same in every state: zero weights, and these biases."""
    for parameter in policy.parameters():
        parameter.data.zero_()
    for head, biases in (policy.near, near), (policy.far, far):
        bias(head).data[:] = torch.tensor(biases, dtype=torch.float64)


def always(policy: Policy, action: int) -> None:
    """A policy so saturated that it never draws anything else."""
    set_logits(policy, *[tuple(60.0 * (a == action) for a in range(4))] * 2)


def says(*choices: str) -> Callable[[Clip, Clip, str], str]:
    """A parent who gives these answers in turn, and the last one ever after."""
    left = list(choices)
    return lambda *_: left.pop(0) if len(left) > 1 else left[0]


def born(rules: Gridworld, *choices: str, **settings: float | bool | None) -> Reference:
    """A trial whose pi_1 prefers nothing. What is not set does not happen."""
    quiet = {"p_guid": 0, "p_rec": 0, "p_pref": 0, "p_train": 0}
    config = Config.model_validate({**quiet, "dtype": "float64", **settings})
    trial = Reference(rules, config, seed=7, trial=0, choose=says(*(choices or ("either",))))
    set_logits(trial.pi)
    return trial


def live(trial: Reference, ticks: int) -> Reference:
    for _ in range(ticks):
        trial.tick()
    return trial


def completed(trial: Reference, kind: str) -> list[Recorded]:
    return [recorded for recorded in trial.clips[kind] if recorded]
