"""Time and memory of a trial by the number of trials. On one core.

    python -m benchmarks.scale            100, 1000 and 10,000 trials, about six minutes
    python -m benchmarks.scale --quick    100 and 300 trials, about 20 seconds

As `parenting run --workers 1` raises them: chunk after chunk, `TICKS` ticks each, on the island. Each number
of trials has a process of its own, whose memory at its highest is counted with Python and torch in it:
*beyond* is what was not there before the first trial. Times are the process's own on the processor, so other
programs beside matter little, and begin after two trials that nobody counts.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from resource import RUSAGE_SELF, getrusage
from time import process_time
from typing import NamedTuple

import torch

from parenting._process import settle
from parenting.agent.config import compose
from parenting.envs import registry
from parenting.experiments.training.chunks import TrainPlan, chunks, train_in_chunks
from parenting.experiments.training.stop_rule import StopRule

WORLD, LEVEL, PRESETS, TICKS = "unsafe-exploration", "island", ("conservative", "direct"), 50
SIZES, QUICK_SIZES = (100, 1000, 10_000), (100, 300)
HEAD = "      preset  trials  chunk  ms/trial-step  against the first  MB at most  beyond"


class Line(NamedTuple):
    """Measurements of one number of trials."""

    preset: str
    trials: int
    step: float  # seconds of a trial-step
    most: float  # MB
    before: float  # MB, before the first trial

    def row(self, first: Line) -> str:
        """A row of the table."""
        return (
            f"{self.preset:>12} {self.trials:>7} {len(chunks(self.trials)[0]):>6} {1e3 * self.step:>14.3f}"
            f" {self.step / first.step:>18.2f} {self.most:>12.0f} {self.most - self.before:>7.0f}"
        )


def measure(preset: str, trials: int) -> Line:
    """Raise so many trials in this process."""
    settle()
    train_in_chunks(plan(preset, 2), 1)
    before, began = memory(), process_time()
    train_in_chunks(plan(preset, trials), 1)
    return Line(preset, trials, (process_time() - began) / trials / TICKS, memory(), before)


def plan(preset: str, trials: int) -> TrainPlan:
    """Trials that live for `TICKS` ticks."""
    config = compose(preset, registry.defaults(WORLD), {}, strict=True)
    return TrainPlan(WORLD, LEVEL, config, 0, trials, StopRule("ticks", TICKS), TICKS)


def memory() -> float:
    """Return the peak memory of this process so far, in MB."""
    return getrusage(RUSAGE_SELF).ru_maxrss / 1024


def alone(preset: str, trials: int) -> Line:
    """Measure in a process of its own."""
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(measure, preset, trials).result()


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description="What a trial costs as there are more of them.")
    parser.add_argument("--quick", action="store_true", help="100 and 300 trials alone")
    sizes = QUICK_SIZES if parser.parse_args().quick else SIZES
    print(f"torch {torch.__version__}, one thread, {WORLD} {LEVEL}, {TICKS} ticks\n{HEAD}")
    for preset in PRESETS:
        first = None
        for trials in sizes:
            line = alone(preset, trials)
            first = first or line
            print(line.row(first), flush=True)


if __name__ == "__main__":
    main()
