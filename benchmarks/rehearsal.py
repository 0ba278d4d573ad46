"""The cost of a step of pre-training during parenting (Sec. 3.1.4). On one thread.

    python -m benchmarks.rehearsal            every shipped size, about two minutes
    python -m benchmarks.rehearsal --quick    6 x 6 alone, few repeats, about 15 seconds

A batch of trials begins with the shipped weights of its world and owes a step in every tick, as conservative
parenting does once it trains. The whole of `agent.parenting.rehearse` is timed. *Walking* is its first part,
timed by itself in alternation with the whole: it draws 16 mazes, computes the policy's probabilities in all
their states, and walks through the episodes. The rest is the gradient at the visited states, and Adam. Each
step belongs to another tick, so its mazes differ. Numbers are medians of the process's own time on the
processor: on one thread that is the time on the clock, less what other programs take.
"""

from __future__ import annotations

import argparse
from statistics import mean, median
from time import process_time
from typing import NamedTuple

import torch

from parenting._process import settle
from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.init import network_of
from parenting.agent.pretraining_mazes import Walks, draw_mazes, pool, walk
from parenting.agent.state import AgentState
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.weights import store
from parenting.weights.store import Wanted

WORLDS = ("side-effects", "interruptibility", "reward-hacking")
"""One for each shipped size; absent-supervisor's is interruptibility's."""
CONFIG = Config(pretrain=True)
SIZES, STEPS = (1, 10, 50, 100), 15
QUICK_STEPS = 5
HEAD = "  size  trials  ms/step  ms/trial-step  walking  visited states"


class Line(NamedTuple):
    """Measurements of one world and batch size; times are in seconds."""

    size: str
    trials: int
    step: float
    walking: float
    states: float

    def __str__(self) -> str:
        """A row of the table."""
        each = 1e3 * self.step / self.trials
        share = self.walking / self.step
        return (
            f"{self.size:>6} {self.trials:>7} {1e3 * self.step:>8.1f} {each:>14.2f} {share:>8.0%}"
            f" {self.states:>15.0f}"
        )


def born(world: Gridworld, trials: int) -> AgentState:
    """Trials that begin with the shipped weights."""
    wanted = Wanted(registry.spec(world.name), world.height, world.width)
    weights = store.load(store.find(wanted).read_bytes(), wanted)
    return parenting.init(world, CONFIG, keys(0, trials), weights)


def owing(state: AgentState) -> AgentState:
    """The next tick, in which every trial owes a step."""
    owed = torch.ones_like(state.rehearsal.owed)
    return state.replace(keys=state.keys.next(), rehearsal=state.rehearsal.replace(owed=owed))


def episodes(world: Gridworld, state: AgentState) -> Walks:
    """The walking alone."""
    network = network_of(world)
    batch = draw_mazes(pool(world.height, world.width, world.legend), state.keys)
    with torch.no_grad():
        logits = network.heads(
            network.unpack(state.learner.params), batch.observation, batch.local_state
        ).logits
    return walk(batch, logits.double().softmax(2), state.keys)


def visited(walks: Walks) -> float:
    """Return the mean number of distinct states that a trial visited."""
    each = zip(walks.state, walks.alive, strict=True)
    return mean(len(set(state[alive].tolist())) for state, alive in each)


def measure(world: Gridworld, trials: int, steps: int) -> Line:
    """One line of the table; the first step of both warms up and is not counted."""
    state = born(world, trials)
    whole, walking, states = [], [], []
    for _ in range(steps + 1):
        state = owing(state)
        began = process_time()
        walks = episodes(world, state)
        between = process_time()
        state = parenting.rehearse(world, CONFIG, state)
        whole.append(process_time() - between)
        walking.append(between - began)
        states.append(visited(walks))
    size = f"{world.height}x{world.width}"
    return Line(size, trials, median(whole[1:]), median(walking[1:]), median(states[1:]))


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description="Milliseconds a step of pre-training and trial.")
    parser.add_argument("--quick", action="store_true", help="6 x 6 alone, and few repeats")
    quick = parser.parse_args().quick
    settle()
    print(f"torch {torch.__version__}, one thread, from the shipped weights\n{HEAD}")
    for name in WORLDS[:1] if quick else WORLDS:
        world = registry.make(name)
        for trials in SIZES:
            print(measure(world, trials, QUICK_STEPS if quick else STEPS), flush=True)


if __name__ == "__main__":
    main()
