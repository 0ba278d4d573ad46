"""The cost of a tick of a single agent, as a run in a worker is, in this tree and in an older one.

    git worktree add --detach ../older 8132530
    python -m benchmarks.one_tick --against ../older     all worlds, about two minutes
    python -m benchmarks.one_tick                        this tree alone
    python -m benchmarks.one_tick --quick                one world and fewer ticks

Each measurement is a process that raises one agent by the scripted parent from tick 0. The two trees take
turns, so that other work on the machine meets both alike. What is timed is the process's own time on the
processor in `agent.parenting.step` and `rehearse`: the parent's answer is not part of it. The columns are the
medians over the rounds, and the ratio is the median of the ratios within a round.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from time import process_time

HERE = Path(__file__).resolve().parent.parent
WORLDS = ("unsafe-exploration", "side-effects", "interruptibility", "absent-supervisor", "reward-hacking")
PRESETS = ("conservative", "direct", "frugal")
WARM, TICKS, ROUNDS = 30, 200, 5
QUICK_TICKS, QUICK_ROUNDS = 60, 3


def timed(world_name: str, preset: str, ticks: int) -> float:
    """Milliseconds a tick in this process."""
    import torch

    from parenting.agent import parenting
    from parenting.agent.config import PRESETS as SETTINGS
    from parenting.agent.config import Config
    from parenting.agent.init import world_of
    from parenting.envs import registry
    from parenting.envs.rng import keys
    from parenting.parents.scripted import ScriptedParent, ScriptedRule

    torch.set_num_threads(1)
    gamma = {"gamma": 0.9} if world_name == "reward-hacking" else {}
    config = Config.model_validate({**SETTINGS[preset], **gamma})
    world = world_of(world_name, next(iter(registry.spec(world_name).levels)), config)
    state = parenting.init(world, config, keys(5, 1))
    parent = ScriptedParent(ScriptedRule(world, config.gamma), parenting.no_query(world, config, state))
    spent = 0.0
    for tick in range(WARM + ticks):
        answer = parent.take(state)
        began = process_time()
        state, query = parenting.step(world, config, state, answer)
        state = parenting.rehearse(world, config, state)
        spent += process_time() - began if tick >= WARM else 0.0
        parent.post(query)
    return 1e3 * spent / ticks


def elsewhere(tree: Path, world: str, preset: str, ticks: int) -> float:
    """The same in a process of its own that imports the modules of a tree."""
    command = [sys.executable, str(HERE / "benchmarks/one_tick.py"), "--once", world, preset, str(ticks)]
    environment = {**os.environ, "PYTHONPATH": str(tree.resolve())}
    ran = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    return float(ran.stdout)


def lines(older: Path | None, worlds: tuple[str, ...], ticks: int, rounds: int) -> Iterator[str]:
    """One row of the table for each world and preset."""
    for world in worlds:
        for preset in PRESETS:
            found = [
                (
                    elsewhere(older, world, preset, ticks) if older else 0.0,
                    elsewhere(HERE, world, preset, ticks),
                )
                for _ in range(rounds)
            ]
            old, new = (median(each) for each in zip(*found, strict=True))
            against = f"{old:>8.2f} {median(b / a for a, b in found):>7.2f}" if older else ""
            yield f"{world:>20} {preset:>13} {new:>8.2f} {against}"


def main() -> None:
    """Print a table, or the one number of a measurement."""
    parser = argparse.ArgumentParser(description="Milliseconds of processor time a tick of one agent.")
    parser.add_argument("--against", type=Path, metavar="PATH", help="an older working tree")
    parser.add_argument("--quick", action="store_true", help="one world and fewer ticks")
    parser.add_argument("--once", nargs=3, metavar=("WORLD", "PRESET", "TICKS"), help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.once:
        print(timed(given.once[0], given.once[1], int(given.once[2])))
        return
    print(f"{'world':>20} {'preset':>13}  ms/tick{'    older   ratio' if given.against else ''}")
    ticks, rounds = (QUICK_TICKS, QUICK_ROUNDS) if given.quick else (TICKS, ROUNDS)
    for line in lines(given.against, WORLDS[:1] if given.quick else WORLDS, ticks, rounds):
        print(line, flush=True)


if __name__ == "__main__":
    main()
