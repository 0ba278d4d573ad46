"""The gradient of Eq. (2) and its entropies by the policy's parameters, written out layer by layer.

Torch's autograd computes the same numbers, bit for bit, from the same operations in the same order
(tests/agent/test_backpropagation.py). For a single agent, whose operations are tiny, most of its time goes
into the graph that it builds and walks; here there is none.
"""

from __future__ import annotations

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from parenting.agent.policy import Affine, Heads, Network, Trace, gathered

_softplus_backward = torch.ops.aten.softplus_backward.default
_relu_backward = torch.ops.aten.threshold_backward.default


def by_margin(margin: Float[Tensor, "N R"], mu: tuple[Tensor, Tensor]) -> Float[Tensor, "N R"]:
    """The derivative of the loss of each row by its margin z[a_0] - z[a_1].

    Both parts of `mu` are contiguous: numbers apart take another path, which rounds otherwise.
    """
    one, other = mu
    found: Tensor = _softplus_backward(other, margin, 1, 20) - _softplus_backward(one, -margin, 1, 20)
    return found


def by_logits(
    margin: Float[Tensor, "N R"], like: Float[Tensor, "N S 4"], place: Int64[Tensor, "N 2R"]
) -> Float[Tensor, "N S 4"]:
    """The derivative of the loss by the logits of pi.

    Args:
        margin: The derivative by the margin of each row.
        like: The logits.
        place: The places of each row's two first actions among a trial's logits, one after the other.
    """
    both = torch.stack((margin, -margin), -1).view(place.shape)
    return torch.zeros_like(like).view(len(like), -1).scatter_add_(1, place, both).view(like.shape)


def by_entropy(
    logs: Float[Tensor, "2 N S 4"], chances: Float[Tensor, "2 N S 4"], factor: Float[Tensor, "2 N S 1"]
) -> Float[Tensor, "2 N S 4"]:
    """The derivative of minus lambda times the weighted entropy by the logits of both heads.

    Args:
        logs: The logarithms of their softmax.
        chances: The softmax.
        factor: The weight of each state, times lambda of each head.
    """
    gradient = factor * logs * chances + factor * chances
    return torch._log_softmax_backward_data(gradient, logs, -1, logs.dtype)


def gradient(network: Network, layers: list[Affine], trace: Trace, by_heads: Heads) -> Float[Tensor, "N P"]:
    """The gradient by all parameters as flat rows, each trial's by itself.

    Args:
        network: The architecture.
        layers: Weights and biases.
        trace: The pass through them.
        by_heads: The derivative by the logits of either head.
    """
    _, local_out, *convolutions, dense, out = layers
    x, near, *patches, flat, far = trace.inputs
    found = [*_affine(x, _through(by_heads.local, local_out, near)), *_affine(near, by_heads.local)]
    last = [*_affine(far, by_heads.overall)]
    back = _through(by_heads.overall, out, far)
    last = [*_affine(flat, back), *last]
    middle: list[Tensor] = []
    if convolutions:
        back = back.bmm(dense.weight.transpose(1, 2)).view_as(trace.grids[-1])
    for place in reversed(range(len(convolutions))):
        back = _relu_backward(back, trace.grids[place], 0).flatten(1, 3)
        middle = [*_affine(patches[place], back), *middle]
        if place:
            back = _onward(network, place, back.bmm(convolutions[place].weight.transpose(1, 2)), trace.grids)
    return torch.cat((*found, *middle, *last), dim=1)


def _affine(x: Float[Tensor, "N B fan_in"], back: Float[Tensor, "N B fan_out"]) -> tuple[Tensor, Tensor]:
    """The gradient by a layer's weights and by its biases, as flat rows."""
    bias = back.sum(1) if back.shape[1] > 1 else back.squeeze(1)
    return x.transpose(1, 2).bmm(back).view(len(x), -1), bias


def _through(back: Float[Tensor, "N B 4"], layer: Affine, hidden: Float[Tensor, "N B 64"]) -> Tensor:
    """The gradient before the rectifier whose output the layer multiplies."""
    found: Tensor = _relu_backward(back.bmm(layer.weight.transpose(1, 2)), hidden, 0)
    return found


def _onward(network: Network, place: int, back: Tensor, grids: list[Tensor]) -> Float[Tensor, "N S H W C"]:
    """The gradient by the grid that a convolution sees: its patches gathered, its padding cut off."""
    pads, below = network.convolutions[place].padding, grids[place - 1]
    assert pads
    tall, wide = pads
    height, width = below.shape[2:4]
    whole = gathered(back.view(*grids[place].shape[:4], -1))
    return whole[:, :, tall.before : tall.before + height, wide.before : wide.before + width]
