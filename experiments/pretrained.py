"""The weights that pre-trained trials of an experiment begin with (Sec. 3.1.4): the shipped ones."""

from __future__ import annotations

from jaxtyping import Float
from torch import Tensor

from parenting.agent.config import Config
from parenting.envs.gridworld import Gridworld
from parenting.weights.store import Wanted, shipped


def pretrained(world: Gridworld) -> Float[Tensor, "P"]:
    """The shipped weights for a world.

    Raises:
        NoWeightsError: there are none for its kind and size.
    """
    return shipped(Wanted(world.spec, world.height, world.width))


def weights_of(world: Gridworld, config: Config) -> Float[Tensor, "P"] | None:
    """What the trials of a world begin with; None where the config does not ask for pre-trained ones.

    Raises:
        NoWeightsError: as `pretrained`.
    """
    return pretrained(world) if config.pretrain else None
