"""The module that stands in the docstring of `agent/policy.py` is the network: same weights, same logits."""

from __future__ import annotations

import textwrap
from typing import Any

import pytest
import torch
from torch import Tensor, nn
from torch.nn.functional import one_hot

from parenting.agent import policy
from parenting.agent.architecture import padding
from parenting.agent.policy import Network, network_for
from parenting.envs.rng import Stream, keys
from tests.agent.batched_runs import layers

CODES = 5


def picture(height: int, width: int) -> nn.Module:
    """The class in the docstring, for boards of this size."""
    code = (policy.__doc__ or "").partition("::\n")[2].partition("\nHere all parameters")[0]
    names: dict[str, Any] = {"nn": nn, "padding": padding}
    exec(textwrap.dedent(code), names)
    made: nn.Module = names["Policy"](height, width, CODES)
    return made.double()


def load(module: nn.Module, network: Network, parameters: Tensor) -> None:
    """Give the module the network's weights: [fan in, fan out] becomes [out, in], or [out, channel, 3, 3]."""
    parts = layers(network, parameters)
    with torch.no_grad():
        for ours, theirs in zip(module.parameters(), parts, strict=True):
            ours.copy_((theirs.T if theirs.dim() == 2 else theirs).reshape(ours.shape))


@pytest.mark.parametrize("size", [(8, 8), (4, 4), (3, 5), (2, 2), (1, 7), (6, 9)])
def test_the_picture_has_the_networks_logits(size: tuple[int, int]) -> None:
    network, key = network_for(*size, CODES), keys(2, 1)
    parameters = network.init_params(key, torch.float64)
    parameters += 0.1 * (key.uniform(Stream.BATCH, network.size) - 0.5)  # biases that are not zero
    module = picture(*size)
    load(module, network, parameters[0])
    draw = torch.Generator().manual_seed(1)
    seen = torch.randint(CODES, (6, *size), dtype=torch.uint8, generator=draw)
    near = torch.randint(CODES, (6, 4), dtype=torch.uint8, generator=draw)
    expected = network.heads(network.unpack(parameters), seen[None], near[None]).logits[0]
    board = one_hot(seen.long(), CODES).permute(0, 3, 1, 2).double()
    found = module(one_hot(near.long(), CODES).flatten(1).double(), board)
    torch.testing.assert_close(found, expected, rtol=1e-12, atol=1e-12)
    assert float(expected.detach().std()) > 0
