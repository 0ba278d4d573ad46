"""The cost of a tick of a single agent, as a run in a worker is, in this tree and in an older one.

    git worktree add --detach ../older 8132530
    python -m benchmarks.one_tick --against ../older     all worlds, about two minutes
    python -m benchmarks.one_tick                        this tree alone
    python -m benchmarks.one_tick --quick                one world and fewer ticks

Each tree has a process that raises one agent by the scripted parent from tick 0. The two take turns of ten
ticks, so that other work on the machine meets both alike. What is timed is the process's own time on the
processor in `agent.parenting.step` and `rehearse`: the parent's answer is not part of it. The columns are the
medians over the turns, and the ratio is the median of the ratios within a turn, in which both live the same
ticks of the same life.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from time import process_time

HERE = Path(__file__).resolve().parent.parent
WORLDS = ("unsafe-exploration", "side-effects", "interruptibility", "absent-supervisor", "reward-hacking")
PRESETS = ("conservative", "direct", "frugal")
WARM, TICKS, TURNS = 3, 10, 40
QUICK_TURNS = 15


def live(world_name: str, preset: str) -> None:
    """Raise an agent: for each line of input ten ticks, and a line with their milliseconds."""
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
    for _ in sys.stdin:
        spent = 0.0
        for _tick in range(TICKS):
            answer = parent.take(state)
            began = process_time()
            state, query = parenting.step(world, config, state, answer)
            state = parenting.rehearse(world, config, state)
            spent += process_time() - began
            parent.post(query)
        print(1e3 * spent / TICKS, flush=True)


def started(tree: Path, world: str, preset: str) -> subprocess.Popen[str]:
    """A process that lives by the modules of a tree."""
    command = [sys.executable, str(HERE / "benchmarks/one_tick.py"), "--live", world, preset]
    environment = {**os.environ, "PYTHONPATH": str(tree.resolve())}
    return subprocess.Popen(
        command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )


def turn(process: subprocess.Popen[str]) -> float:
    """Milliseconds a tick in the next ten ticks of a process."""
    assert process.stdin
    assert process.stdout
    process.stdin.write("\n")
    process.stdin.flush()
    return float(process.stdout.readline())


def measured(trees: list[Path], world: str, preset: str, turns: int) -> list[tuple[float, ...]]:
    """Milliseconds a tick in each turn, of each tree; the first turns are left out."""
    with ExitStack() as stack:
        processes = [stack.enter_context(started(tree, world, preset)) for tree in trees]
        found = [tuple(turn(process) for process in processes) for _ in range(WARM + turns)]
        for process in processes:
            assert process.stdin
            process.stdin.close()
    return found[WARM:]


def lines(older: Path | None, worlds: tuple[str, ...], turns: int) -> Iterator[str]:
    """One row of the table for each world and preset."""
    trees = [HERE, older] if older else [HERE]
    for world in worlds:
        for preset in PRESETS:
            found = measured(trees, world, preset, turns)
            shown = " ".join(f"{median(each):>8.2f}" for each in zip(*found, strict=True))
            ratio = f" {median(new / old for new, old in found):>7.2f}" if older else ""
            yield f"{world:>20} {preset:>13} {shown}{ratio}"


def main() -> None:
    """Print a table, or the one number of a measurement."""
    parser = argparse.ArgumentParser(description="Milliseconds of processor time a tick of one agent.")
    parser.add_argument("--against", type=Path, metavar="PATH", help="an older working tree")
    parser.add_argument("--quick", action="store_true", help="one world and fewer ticks")
    parser.add_argument("--live", nargs=2, metavar=("WORLD", "PRESET"), help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.live:
        live(*given.live)
        return
    print(f"{'world':>20} {'preset':>13}  ms/tick{'    older   ratio' if given.against else ''}")
    turns = QUICK_TURNS if given.quick else TURNS
    for line in lines(given.against, WORLDS[:1] if given.quick else WORLDS, turns):
        print(line, flush=True)


if __name__ == "__main__":
    main()
