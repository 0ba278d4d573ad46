"""The proportion of a trial-step's time that `torch.bmm` alone would take. One thread.

    python -m benchmarks.roofline            every size of batch, about three minutes
    python -m benchmarks.roofline --quick    50 trials alone, about 20 seconds

**Operations of a trial-step.** A layer takes B rows of `rows` numbers to B rows of `columns` numbers by one
product of [B, rows] with [rows, columns]: `2 B rows columns` floating-point operations, a multiplication and
an addition for each term. For a dense layer B is the number of states S. A convolution is the same product on
patches: B is S times the places of its output, and `rows` is 9 times the channels of its input. A cell of
padding is multiplied like any other, so it counts.

- The agent looks at its own state once: every layer with S = 1.
- A gradient step runs over the S distinct states of X. Forward: every layer. Backward: the gradient of the
  weights is [rows, B] with [B, columns], and that of the inputs is [B, columns] with [columns, rows]: as many
  operations each. The first layer of each head has no gradient of its inputs: they are what the agent sees.

So a trial-step that trains costs the sum of 2 rows columns places (1 + 3 S) over the layers, where a dense
layer has one place, less 2 S rows columns places of the two first ones. All trials of a batch are padded to
the S of the fullest one: `padded` counts what is multiplied, `own` what each trial's own states need. A trial
that does not train in a tick counts its look alone. Biases, ReLU, patches, the loss, Adam, the worlds, the
parent and the clips cost time and count nothing: they are what we lose.

**The yardstick.** `torch.bmm` multiplies stacks of contiguous matrices of exactly these shapes, one product
after the other, in the same run, alternating with the ticks. The share is the time that it takes for the
products of a tick divided by the time of the tick: 100 % would be a tick that does nothing else. `step` is
the same share for a gradient step by itself, forward and backward, and `Adam` for that with Adam.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from copy import copy
from statistics import median
from time import perf_counter
from typing import NamedTuple

import torch
from torch import Tensor

from parenting._process import settle
from parenting.agent import learning
from parenting.agent.config import compose
from parenting.agent.init import network_of
from parenting.agent.policy import Network
from parenting.envs import registry
from parenting.envs.rng import keys
from parenting.experiments.training.batch import BatchTrainer
from parenting.experiments.training.counts import no_counts
from parenting.experiments.training.stop_rule import StopRule

WORLD, LEVEL, PRESETS = "unsafe-exploration", "island", ("conservative", "direct")
WARM, BORN = 100, 50
"""Ticks that the agents live before anything is timed, and how many agents; batches are copies of them."""
SIZES, QUICK_SIZES = (1, 8, 50, 100, 200), (50,)
REPEATS, QUICK_REPEATS = 7, 5
TICKS = 6
"""Of a batch, between two turns of the yardstick."""
HEAD = " trials  states  training  ms/trial-step  bmm GFLOP/s     step     Adam  whole: padded       own"


class Product(NamedTuple):
    """[N, left, inner] times [N, inner, right]."""

    left: int
    inner: int
    right: int


class Line(NamedTuple):
    """One size of batch; times in seconds of a tick of the whole batch."""

    trials: int
    states: int
    training: float  # the share of trials that train in a tick
    tick: float
    step: float
    adam: float
    bmm: float  # of the gradient step of all trials
    look: float  # of the look at the own state
    operations: int  # of the gradient step of all trials
    own: float  # the share of them that the trials' own states need

    def __str__(self) -> str:
        """A row of the table."""
        useful = self.training * self.bmm
        return (
            f"{self.trials:>7} {self.states:>7} {self.training:>9.0%} {1e3 * self.tick / self.trials:>14.3f}"
            f" {self.operations / self.bmm / 1e9:>12.1f}"
            f" {self.bmm / self.step:>8.0%} {self.bmm / self.adam:>8.0%}"
            f" {(useful + self.look) / self.tick:>14.0%} {(useful * self.own + self.look) / self.tick:>9.0%}"
        )


def products(network: Network, states: int) -> list[Product]:
    """The products of one gradient step in one trial, forward and backward (derived above)."""
    found: list[Product] = []
    first = {network.layers[0], network.layers[2]}  # of the local head, and of the global one
    for layer in network.layers:
        places = layer.padding[0].length * layer.padding[1].length if layer.padding else 1
        batch = states * places
        found += [Product(batch, layer.fan_in, layer.fan_out), Product(layer.fan_in, batch, layer.fan_out)]
        if layer not in first:
            found.append(Product(batch, layer.fan_out, layer.fan_in))
    return found


def looks(network: Network) -> list[Product]:
    """The products of one look at one state."""
    return [
        Product(
            layer.padding[0].length * layer.padding[1].length if layer.padding else 1,
            layer.fan_in,
            layer.fan_out,
        )
        for layer in network.layers
    ]


def operands(shape: Product, trials: int, dtype: torch.dtype) -> tuple[Tensor, Tensor]:
    """Two stacks of random matrices to multiply."""
    left = torch.rand(trials, shape.left, shape.inner, dtype=dtype)
    return left, torch.rand(trials, shape.inner, shape.right, dtype=dtype)


def multiplying(shapes: Sequence[Product], trials: int) -> Callable[[], object]:
    """torch.bmm on random matrices of some shapes, one after the other."""
    pairs = [operands(shape, trials, torch.float32) for shape in shapes]
    return lambda: [torch.bmm(left, right) for left, right in pairs]


def operations(shapes: Sequence[Product]) -> int:
    """Floating-point operations of some products."""
    return sum(2 * shape.left * shape.inner * shape.right for shape in shapes)


def seconds(act: Callable[[], object]) -> float:
    """Measure the time of a call."""
    began = perf_counter()
    act()
    return perf_counter() - began


def born(preset: str) -> BatchTrainer:
    """Fifty agents at tick `WARM`."""
    config = compose(preset, registry.defaults(WORLD), {}, strict=True)
    world = registry.make(WORLD, LEVEL, time_limit=config.max_episode_steps)
    trainer = BatchTrainer(world, config, keys(0, BORN), StopRule("ticks", 10**9))
    for _ in range(WARM):
        trainer.tick()
    return trainer


def copies(trainer: BatchTrainer, trials: int) -> BatchTrainer:
    """A batch of `trials` agents with their parent, copied from those of `trainer` in turn."""
    index = torch.arange(trials) % BORN
    batch = BatchTrainer(trainer.world, trainer.config, keys(0, trials), trainer.until)
    batch.state, batch.counts = trainer.state.pick(index), no_counts(trials)
    batch.parent = copy(trainer.parent)
    batch.parent.pick(index)
    return batch


def measure(trainer: BatchTrainer, trials: int, repeats: int) -> Line:
    """One size of batch."""
    network, config = network_of(trainer.world), trainer.config
    state = copies(trainer, trials).state
    rows = learning.choose(config, state.x, state.keys, 0)
    states = rows.local_state.shape[1]
    every = torch.ones(trials, dtype=torch.bool)

    def step() -> object:
        return learning.differentiate(network, config, state.learner.params, rows)

    def whole_step() -> None:
        _, gradient = learning.differentiate(network, config, state.learner.params, rows)
        adam(state.learner.params, state.learner, gradient, every, 0.0)

    acts = (
        step,
        whole_step,
        multiplying(products(network, states), trials),
        multiplying(looks(network), trials),
    )
    for act in acts:
        act()
    times: list[tuple[float, ...]] = []
    training: list[float] = []
    for _ in range(repeats):
        tick, trained = live(copies(trainer, trials))
        training += trained
        times.append((tick, *map(seconds, acts)))
    tick, gradient, adam, bmm, look = (median(column) for column in zip(*times, strict=True))
    own = [operations(products(network, int(number))) for number in state.x.states]
    most = operations(products(network, states))
    return Line(
        trials,
        states,
        sum(training) / len(training),
        tick,
        gradient,
        adam,
        bmm,
        look,
        trials * most,
        sum(own) / trials / most,
    )


def live(batch: BatchTrainer) -> tuple[float, list[float]]:
    """Seconds a tick, and the share of the trials that trained in each."""
    trained = list[float]()
    began = perf_counter()
    for _ in range(TICKS):
        batch.tick()
        trained.append(float(batch.state.info.trained.double().mean()))
    return (perf_counter() - began) / TICKS, trained


def main() -> None:
    """Print a table for each preset."""
    parser = argparse.ArgumentParser(
        description="The share of torch.bmm's speed that a whole trial-step has."
    )
    parser.add_argument("--quick", action="store_true", help="50 trials alone")
    quick = parser.parse_args().quick
    settle()
    print(f"torch {torch.__version__}, one thread, {WORLD} {LEVEL}, after {WARM} ticks")
    for preset in PRESETS:
        trainer = born(preset)
        print(f"\n{preset}\n{HEAD}")
        for trials in QUICK_SIZES if quick else SIZES:
            print(measure(trainer, trials, QUICK_REPEATS if quick else REPEATS), flush=True)


if __name__ == "__main__":
    main()
