"""Policies made by hand: strings of letters through a model, and networks whose argmax one can see."""

from __future__ import annotations

from itertools import count

import torch
from torch import Tensor

from parenting.agent.init import network_of
from parenting.envs.gridworld import Gridworld
from parenting.evaluation.outcomes import TabularPolicy

LETTERS = "udlr"
UP, DOWN, LEFT, RIGHT = range(4)


def spelled(*ways: str) -> TabularPolicy:
    """One way a trial, in letters; the last letter of each is repeated without end."""
    time = count()

    def policy(at: Tensor) -> Tensor:
        t = next(time)
        return torch.tensor([LETTERS.index(way[min(t, len(way) - 1)]) for way in ways])

    return policy


def always(world: Gridworld, action: int) -> Tensor:
    """The weights of a network that prefers one action everywhere."""
    network = network_of(world)
    weights = torch.zeros(1, network.size)
    weights[0, network.layers[1].bias + action] = 1.0
    return weights


def at_a_wall(world: Gridworld, action: int, instead: int) -> Tensor:
    """The weights of a network that prefers `action`, and `instead` where a wall stands in that way."""
    network = network_of(world)
    weights = always(world, action)
    local_in, local_out = network.layers[:2]
    wall = action * network.codes  # the input that says: that neighbour is of code 0, a wall
    weights[0, local_in.start + wall * local_in.fan_out] = 1.0  # into hidden unit 0
    weights[0, local_out.start + instead] = 9.0  # and from there to the other action
    return weights


def on_sight(world: Gridworld, glyph: str, action: int, otherwise: int) -> Tensor:
    """The weights of a network that prefers `action` wherever it sees a glyph, and else another."""
    network = network_of(world)
    weights = always(world, otherwise)
    channels, channel = network.codes, world.code(glyph)
    for layer in (*network.convolutions, *network.layers[-2:]):
        into = action if layer is network.layers[-1] else 0
        for row in range(channel, layer.fan_in, channels):  # the sum of one channel over all places
            weights[0, layer.start + row * layer.fan_out + into] = 1.0
        last = layer is network.layers[-2]
        channels, channel = (layer.fan_in if last else layer.fan_out), 0
    return weights
