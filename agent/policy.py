"""The policy pi(a|s): a local and a global head, averaged, then softmax (Sec. 3.1.1). One network a trial.

For one trial it is this module; `tests/agent/test_picture_of_the_policy.py` runs it and compares the logits::

    class Policy(nn.Module):
        def __init__(self, height, width, codes):
            super().__init__()
            self.local = nn.Sequential(nn.Linear(4 * codes, 64), nn.ReLU(), nn.Linear(64, 4))
            self.convolutions, channels = nn.Sequential(), codes
            for filters in (16, 32, 64, 64):
                if height <= 2 and width <= 2:
                    break
                tall, wide = padding(height), padding(width)
                pad = nn.ZeroPad2d((wide.before, wide.after, tall.before, tall.after))
                self.convolutions.extend([pad, nn.Conv2d(channels, filters, 3), nn.ReLU()])
                height, width, channels = tall.length, wide.length, filters
            flat = height * width * channels
            self.overall = nn.Sequential(nn.Linear(flat, 64), nn.ReLU(), nn.Linear(64, 4))

        def forward(self, local_state, observation):  # one-hot: [S, 4 codes], [S, codes, H, W]
            patches = self.convolutions(observation).permute(0, 2, 3, 1)  # row, column, channel
            return (self.local(local_state) + self.overall(patches.flatten(1))) / 2  # logits [S, 4]

Here all parameters of a trial are one flat row, so that freezing, copying and Adam are a few operations on
`[N, P]`. Convolutions are matrix products of patches (im2col), so that every layer is one `baddbmm` over the
trials.
"""

from __future__ import annotations

from functools import cache, cached_property
from math import sqrt
from typing import NamedTuple

import torch
from jaxtyping import Float, Int64, UInt8
from torch import Tensor
from torch.autograd.function import FunctionCtx

from parenting.agent.architecture import ACTIONS, FILTERS, HIDDEN, Padding, padding
from parenting.envs.rng import Keys, Stream


class Layer(NamedTuple):
    """Weights `[fan_in, fan_out]` and biases, at `start` of the row; a convolution has a padding."""

    fan_in: int
    fan_out: int
    start: int
    padding: tuple[Padding, Padding] | None = None

    @property
    def bias(self) -> int:
        """Where the biases begin."""
        return self.start + self.fan_in * self.fan_out

    @property
    def end(self) -> int:
        """Where the layer ends."""
        return self.bias + self.fan_out

    @property
    def glorot_fans(self) -> tuple[int, int]:
        """Numbers of inputs and outputs as Glorot initialisation counts them."""
        return (self.fan_in, 9 * self.fan_out) if self.padding else (self.fan_in, self.fan_out)


class Heads(NamedTuple):
    """The logits of both heads before they are averaged."""

    local: Float[Tensor, "N S 4"]
    overall: Float[Tensor, "N S 4"]  # "global" is a keyword

    @property
    def logits(self) -> Float[Tensor, "N S 4"]:
        """The logits of pi: the mean of the two heads."""
        return (self.local + self.overall) / 2


class Affine(NamedTuple):
    """One layer's weights and biases, stacked over the trials."""

    weight: Float[Tensor, "N fan_in fan_out"]
    bias: Float[Tensor, "N 1 fan_out"]

    def __call__(self, x: Float[Tensor, "N B fan_in"]) -> Float[Tensor, "N B fan_out"]:
        """Every trial's inputs through its own layer."""
        return torch.baddbmm(self.bias, x, self.weight)


class Seen(NamedTuple):
    """Observations as the network takes them: the same for any weights, so that steps on one X share them."""

    near: Float[Tensor, "N S 4O"]  # l(s), one-hot
    first: Float[Tensor, "N S H2 W2 9O"]  # the first convolution's patches, or the one-hot board without one


class Trace(NamedTuple):
    """One pass through the network: the logits, and what `agent.backpropagation` needs of the layers."""

    heads: Heads
    inputs: list[Float[Tensor, "N B fan_in"]]  # what each layer multiplied, in their order
    grids: list[Float[Tensor, "N S H2 W2 C"]]  # what each convolution gave


class Network:
    """The architecture for boards of `height` x `width` with `codes` kinds of things. It holds no weights."""

    def __init__(self, height: int, width: int, codes: int) -> None:
        """Lay the layers out: local dense and out, convolutions, global dense and out."""
        self.height, self.width, self.codes = height, width, codes
        self.layers: list[Layer] = []
        self._add(ACTIONS * codes, HIDDEN)
        self._add(HIDDEN, ACTIONS)
        flat = self._add_convolutions()
        self._add(flat, HIDDEN)
        self._add(HIDDEN, ACTIONS)
        self.size = self.layers[-1].end

    def _add(self, fan_in: int, fan_out: int, pads: tuple[Padding, Padding] | None = None) -> None:
        self.layers.append(Layer(fan_in, fan_out, self.layers[-1].end if self.layers else 0, pads))

    def _add_convolutions(self) -> int:
        height, width, channels = self.height, self.width, self.codes
        for filters in FILTERS:
            if height <= 2 and width <= 2:
                break
            pads = padding(height), padding(width)
            self._add(9 * channels, filters, pads)
            height, width, channels = pads[0].length, pads[1].length, filters
        return height * width * channels

    @cached_property
    def convolutions(self) -> list[Layer]:
        """The layers that are convolutions, in order."""
        return [layer for layer in self.layers if layer.padding]

    @cached_property
    def sizes(self) -> list[int]:
        """The numbers of weights and biases of each layer, alternating."""
        return [size for layer in self.layers for size in (layer.fan_in * layer.fan_out, layer.fan_out)]

    def init_params(self, keys: Keys, dtype: torch.dtype) -> Float[Tensor, "N P"]:
        """Glorot uniform weights and zero biases, drawn from the trials' keys (ours, as TensorFlow 1.12)."""
        parameters = torch.zeros(keys.seed.shape[0], self.size, dtype=dtype, device=keys.seed.device)
        for number, layer in enumerate(self.layers):
            bound = sqrt(6 / sum(layer.glorot_fans))
            drawn = (2 * keys.uniform(Stream.WEIGHTS + number, layer.fan_in, layer.fan_out) - 1) * bound
            if layer.padding:
                # drawn as (channel, row, column), kept as (row, column, channel): patches are copied in runs
                split = drawn.view(-1, layer.fan_in // 9, 9, layer.fan_out)
                drawn = split.transpose(1, 2).flatten(1, 2)
            parameters[:, layer.start : layer.bias] = drawn.flatten(1).to(dtype)
        return parameters

    def unpack(self, parameters: Float[Tensor, "N P"]) -> list[Affine]:
        """The layers' weights and biases, as views of the flat rows."""
        parts = parameters.split_with_sizes(self.sizes, dim=1)
        return [
            Affine(weight.view(-1, layer.fan_in, layer.fan_out), bias.unsqueeze(1))
            for layer, weight, bias in zip(self.layers, parts[::2], parts[1::2], strict=True)
        ]

    def leaf_params(self, parameters: Float[Tensor, "N P"]) -> list[Affine]:
        """The same as leaves of a graph of their own: what `gradient` differentiates by."""
        return [
            Affine(*(part.detach().requires_grad_() for part in layer)) for layer in self.unpack(parameters)
        ]

    def gradient(self, value: Float[Tensor, "N"], layers: list[Affine]) -> Float[Tensor, "N P"]:
        """The gradient of each trial's value by its own parameters, as flat rows."""
        parts = torch.autograd.grad(value.sum(), [part for layer in layers for part in layer])
        return torch.cat([part.flatten(1) for part in parts], dim=1)

    def heads(
        self, layers: list[Affine], observation: UInt8[Tensor, "N S H W"], local_state: UInt8[Tensor, "N S 4"]
    ) -> Heads:
        """Both heads' logits in S states a trial: `observation`, and `local_state`, its l(s)."""
        return self.trace(layers, self.see(observation, local_state, layers[0].weight.dtype)).heads

    def see(
        self, observation: UInt8[Tensor, "N S H W"], local_state: UInt8[Tensor, "N S 4"], dtype: torch.dtype
    ) -> Seen:
        """S states a trial as the layers take them: `observation`, and `local_state`, its l(s)."""
        first = self._one_hot(observation, dtype)
        if self.convolutions:
            pads = self.convolutions[0].padding
            assert pads
            first = _patches(first, pads)
        return Seen(self._one_hot(local_state, dtype).flatten(2), first)

    def trace(self, layers: list[Affine], seen: Seen) -> Trace:
        """Both heads' logits where S states a trial are seen, with what every layer saw."""
        local_in, local_out, *convolutions, dense, out = layers
        near = local_in(seen.near).relu_()
        y = seen.first
        inputs: list[Tensor] = [seen.near, near]
        grids: list[Tensor] = []
        for layer, affine in zip(self.convolutions, convolutions, strict=True):
            assert layer.padding
            patches = _patches(y, layer.padding) if grids else y
            inputs.append(patches.flatten(1, 3))
            y = affine(inputs[-1]).relu_().view(*patches.shape[:4], layer.fan_out)
            grids.append(y)
        flat = y.flatten(2)
        far = dense(flat).relu_()
        return Trace(Heads(local_out(near), out(far)), [*inputs, flat, far], grids)

    def _one_hot(self, codes: UInt8[Tensor, "*places"], dtype: torch.dtype) -> Float[Tensor, "*places O"]:
        # torch's one_hot would go by way of 64-bit integers
        return (codes.unsqueeze(-1) == _kinds(self.codes, codes.device)).to(dtype)

    def logits(
        self,
        parameters: Float[Tensor, "N P"],
        observation: UInt8[Tensor, "N H W"],
        local_state: UInt8[Tensor, "N 4"],
    ) -> Float[Tensor, "N 4"]:
        """The logits of pi in one state a trial."""
        with torch.no_grad():
            return self.heads(
                self.unpack(parameters), observation.unsqueeze(1), local_state.unsqueeze(1)
            ).logits.squeeze(1)


@cache
def network_for(height: int, width: int, codes: int) -> Network:
    """The one network for this size of board and legend."""
    return Network(height, width, codes)


@cache
def _kinds(codes: int, device: torch.device) -> UInt8[Tensor, "O"]:
    return torch.arange(codes, dtype=torch.uint8, device=device)


class _Patches(torch.autograd.Function):
    """The 3 x 3 surroundings of every place, one after the other: what a convolution multiplies.

    Autograd's own way back through nine slices would make nine whole copies of the grid.
    """

    @staticmethod
    def forward(context: FunctionCtx, x: Float[Tensor, "N S H W C"]) -> Float[Tensor, "N S H2 W2 9C"]:
        """One copy of overlapping windows."""
        return windows(x)

    @staticmethod
    def backward(context: FunctionCtx, gradient: Float[Tensor, "N S H2 W2 9C"]) -> Float[Tensor, "N S H W C"]:
        """Every cell gathers from the places that it surrounds."""
        return gathered(gradient)


def windows(x: Float[Tensor, "N S H W C"]) -> Float[Tensor, "N S H2 W2 9C"]:
    """The 3 x 3 surroundings of every place that has them all, as one copy."""
    trials, states, height, width, channels = x.shape
    step = x.stride()
    shape = (trials, states, height - 2, width - 2, 3, 3, channels)
    return x.as_strided(shape, (*step[:4], *step[2:])).flatten(4)


def gathered(gradient: Float[Tensor, "N S H2 W2 9C"]) -> Float[Tensor, "N S H W C"]:
    """The gradient by the cells, given that by their `windows`: along each column, then along each row."""
    trials, states, tall, wide, nine = gradient.shape
    channels = nine // 9
    columns = gradient.new_zeros(trials, states, tall + 2, wide, 3 * channels)
    for shift, part in enumerate(gradient.chunk(3, dim=-1)):
        columns.narrow(2, shift, tall).add_(part)
    total = gradient.new_zeros(trials, states, tall + 2, wide + 2, channels)
    for shift, part in enumerate(columns.chunk(3, dim=-1)):
        total.narrow(3, shift, wide).add_(part)
    return total


def _patches(x: Float[Tensor, "N S H W C"], pads: tuple[Padding, Padding]) -> Float[Tensor, "N S H2 W2 9C"]:
    """The patches of a grid, padded first where it has a padding."""
    tall, wide = pads
    if tall.before or tall.after or wide.before or wide.after:
        x = torch.constant_pad_nd(x, [0, 0, wide.before, wide.after, tall.before, tall.after])
    if not x.requires_grad:
        return windows(x)
    patches: Tensor = _Patches.apply(x)  # type: ignore[no-untyped-call]
    return patches


def draw(logits: Float[Tensor, "N 4"], noise: Float[Tensor, "N 4"]) -> Int64[Tensor, "N"]:
    """An action drawn from pi = softmax(logits), given Gumbel noise. Works on a saturated policy, too."""
    return (logits.double() + noise).argmax(-1)
