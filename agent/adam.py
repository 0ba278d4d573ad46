"""Adam, for the trials that train (Sec. 3.1.2)."""

from __future__ import annotations

from itertools import compress
from typing import Protocol

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor

BETA1, BETA2, EPSILON = 0.9, 0.999, 1e-8  # Adam's default parameters (Sec. 3.1.2)


class AdamState(Protocol):
    """The moments that Adam keeps between its steps."""

    @property
    def exp_avg(self) -> Float[Tensor, "N P"]:
        """The running mean of the gradient."""
        ...

    @property
    def exp_avg_sq(self) -> Float[Tensor, "N P"]:
        """The running mean of its square."""
        ...

    @property
    def steps(self) -> Int64[Tensor, "N"]:
        """Steps taken."""
        ...


def adam(
    params: Float[Tensor, "N P"],
    moments: AdamState,
    gradient: Float[Tensor, "K P"],
    training: Bool[Tensor, "N"],
    rate: float,
) -> None:
    """Take one step of Adam in the K trials that train; change nothing in the others. See `Adam`."""
    Adam(params, moments, training).step(gradient, rate)


class Adam:
    """Steps of Adam (Kingma & Ba 2014) in the trials that train; nothing changes in the others.

    torch's fused step passes over the parameters once. It receives each trial as a tensor of its own, because
    each has taken its own number of steps.
    """

    def __init__(self, params: Float[Tensor, "N P"], moments: AdamState, training: Bool[Tensor, "N"]) -> None:
        """Take what the steps change in place.

        Args:
            params: The parameters of all N trials.
            moments: What Adam remembers of all N trials.
            training: Which trials train: K of N.
        """
        chosen = training.tolist()

        def rows(every: Tensor) -> list[Tensor]:
            return list(compress(every.unbind(), chosen))

        self._params, self._taken, self._training = rows(params), moments.steps, training
        self._exp_avg, self._exp_avg_sq = rows(moments.exp_avg), rows(moments.exp_avg_sq)
        self._steps = rows(moments.steps.to(torch.float32))

    def step(self, gradient: Float[Tensor, "K P"], rate: float) -> None:
        """Take one step of size `rate` along the gradients of the K trials that train, in order."""
        if not self._params:
            return
        torch._foreach_add_(self._steps, 1)
        torch._fused_adam_(
            self._params,
            list(gradient.unbind()),
            self._exp_avg,
            self._exp_avg_sq,
            [],
            self._steps,
            lr=rate,
            beta1=BETA1,
            beta2=BETA2,
            weight_decay=0.0,
            eps=EPSILON,
            amsgrad=False,
            maximize=False,
        )
        self._taken.add_(self._training)
