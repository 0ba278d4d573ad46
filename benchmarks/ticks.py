"""Trial-steps a second of the whole tick, and how near a gradient step comes to `torch.bmm`. On one thread.

    python -m benchmarks.ticks            every size of batch, about three minutes
    python -m benchmarks.ticks --quick    up to 50 trials, about 20 seconds

**Ticks.** Fifty agents live their first `WARM` ticks on the island under the scripted parent. Copies of
them make batches of every size, and each repeat lives the same ticks that follow, as `parenting run` does:
an answer, a step, a question, the counting of deaths and queries. Only the test whether a policy is optimal
is left out.

**The share of torch.bmm.** A layer takes B inputs of `rows` numbers to B outputs of `columns` numbers. For
a dense layer B is S, the number of distinct states in X; for a convolution it is S times the places of its
output. The outputs are one product of [B, rows] with [rows, columns]: `2 B rows columns` floating-point
operations, a multiplication and an addition for each term. Backward, the gradient of the weights is [rows,
B] with [B, columns], and that of the inputs [B, columns] with [columns, rows]: as many operations each. The
first layer of each head needs no gradient of its inputs, for they are what the agent sees. So a gradient
step costs six times the sum of B rows columns over the layers, less twice that of the two first ones.
Biases, ReLU, patches and the loss are not counted: they are what we lose.

The share is the time that `torch.bmm` takes for exactly these products, on contiguous matrices, divided by
the time of `learning.differentiate`. The two take turns, so that noise on the machine hits both. All
numbers are medians.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from statistics import median
from time import perf_counter
from typing import NamedTuple

import torch
from torch import Tensor

from agent import learning
from agent.birth import network_of
from agent.config import compose
from agent.policy import Network
from envs import registry
from envs.rng import keys
from experiments.trials import Nursery, Until, no_tally

WORLD, LEVEL, PRESETS = "unsafe-exploration", "island", ("conservative", "direct")
SIZES, QUICK_SIZES = (1, 2, 8, 50, 200, 1000), (1, 8, 50)
REPEATS, QUICK_REPEATS = 7, 3
WARM, BORN = 100, 50


class Product(NamedTuple):
    """[N, left, inner] times [N, inner, right]."""

    left: int
    inner: int
    right: int


class Line(NamedTuple):
    """What was measured for one size of batch; times are in seconds."""

    trials: int
    states: int
    tick: float
    step: float
    bmm: float
    operations: int

    def __str__(self) -> str:
        """A row of the table."""
        speed, work = self.trials / self.tick, self.operations / 1e9
        return (
            f"{self.trials:>7} {speed:>14,.0f} {1e3 / speed:>14.3f} {self.states:>7}"
            f" {work / self.step:>13.1f} {work / self.bmm:>11.1f} {self.bmm / self.step:>7.0%}"
        )


HEAD = " trials  trial-steps/s  ms/trial-step  states  step GFLOP/s  bmm GFLOP/s   share"


def products(network: Network, states: int) -> list[Product]:
    """The products of one gradient step in one trial, forward and backward (derived above)."""
    found: list[Product] = []
    first = {network.layers[0], network.layers[2]}  # of the local head, and of the global one
    for layer in network.layers:
        places = layer.sides[0].length * layer.sides[1].length if layer.sides else 1
        batch = states * places
        found += [Product(batch, layer.rows, layer.columns), Product(layer.rows, batch, layer.columns)]
        if layer not in first:
            found.append(Product(batch, layer.columns, layer.rows))
    return found


def born(preset: str) -> Nursery:
    """Fifty agents at tick `WARM`."""
    config = compose(preset, registry.defaults(WORLD), {}, strict=True)
    world = registry.make(WORLD, LEVEL, time_limit=config.time_limit)
    nursery = Nursery(world, config, keys(0, BORN), Until("ticks", 10**9))
    for _ in range(WARM):
        nursery.tick()
    return nursery


def copies(nursery: Nursery, trials: int) -> Nursery:
    """A batch of `trials` agents with their parent, copied from those of `nursery` in turn."""
    index = torch.arange(trials) % BORN
    batch = Nursery(nursery.world, nursery.config, keys(0, trials), nursery.until)
    batch.state, batch.tally = nursery.state.pick(index), no_tally(trials)
    batch.parent.query = nursery.parent.query.pick(index)
    return batch


def measure(nursery: Nursery, trials: int, repeats: int) -> Line:
    """One size of batch."""
    network, config = network_of(nursery.world), nursery.config
    state = copies(nursery, trials).state
    rows = learning.choose(config, state.x, state.keys, 0)
    states = rows.near.shape[1]
    shapes = products(network, states)
    pairs = [operands(shape, trials, state.learner.live.dtype) for shape in shapes]

    def step() -> None:
        learning.differentiate(network, config, state.learner.live, rows)

    def multiply() -> None:
        for left, right in pairs:
            torch.bmm(left, right)

    ticks, steps = min(100, max(4, 400 // trials)), max(1, 100 // trials)
    times = [(live(copies(nursery, trials), ticks), *in_turns(step, multiply, steps)) for _ in range(repeats)]
    tick, gradient, bmm = (median(column) for column in zip(*times, strict=True))
    operations = trials * sum(2 * shape.left * shape.inner * shape.right for shape in shapes)
    return Line(trials, states, tick, gradient, bmm, operations)


def operands(shape: Product, trials: int, dtype: torch.dtype) -> tuple[Tensor, Tensor]:
    """Two stacks of random matrices to multiply."""
    left = torch.rand(trials, shape.left, shape.inner, dtype=dtype)
    return left, torch.rand(trials, shape.inner, shape.right, dtype=dtype)


def live(batch: Nursery, ticks: int) -> float:
    """Seconds a tick."""
    began = perf_counter()
    for _ in range(ticks):
        batch.tick()
    return (perf_counter() - began) / ticks


def in_turns(one: Callable[[], None], other: Callable[[], None], times: int) -> tuple[float, float]:
    """Median seconds of each, called by turns after a call that warms them up."""
    one()
    other()
    seconds: tuple[list[float], list[float]] = [], []
    for _ in range(times):
        for call, found in zip((one, other), seconds, strict=True):
            began = perf_counter()
            call()
            found.append(perf_counter() - began)
    return median(seconds[0]), median(seconds[1])


def main() -> None:
    """Print a table for each preset."""
    parser = argparse.ArgumentParser(description="Trial-steps a second, and the share of torch.bmm's speed.")
    parser.add_argument("--quick", action="store_true", help="small batches and few repeats")
    quick = parser.parse_args().quick
    torch.set_num_threads(1)
    print(f"torch {torch.__version__}, one thread, {WORLD} {LEVEL}, after {WARM} ticks")
    for preset in PRESETS:
        nursery = born(preset)
        print(f"\n{preset}\n{HEAD}")
        for trials in QUICK_SIZES if quick else SIZES:
            print(measure(nursery, trials, QUICK_REPEATS if quick else REPEATS), flush=True)


if __name__ == "__main__":
    main()
