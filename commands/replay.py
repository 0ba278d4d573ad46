"""`parenting replay`: replay a stored run, and say whether the result is equal bit for bit."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer

from parenting._plural import counted
from parenting.commands.database import database
from parenting.commands.errors import exit_on_interrupt, friendly_errors
from parenting.commands.options import RunNumber
from parenting.commands.printing import say
from parenting.commands.progress import bar
from parenting.server.runs import get_run

if TYPE_CHECKING:
    from parenting.server.replay import Relived

PIECES = {
    "learner.params": "the policy in training",
    "learner.frozen": "the frozen policies",
    "learner": "Adam's state",
    "rehearsal": "pre-training's state",
    "x": "dataset X",
    "recorder": "clips and pairs",
    "familiarity": "familiarity",
    "world": "the world",
    "config": "the config",
    "tally": "counts of answers and deaths",
}
"""Names of pieces of state, by the beginning of their tensors' names; the rest is counts and flags."""


def replay(
    run: RunNumber,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON and nothing else.")
    ] = False,
) -> None:
    """Replay a stored run from its first tick, by its recorded answers and operator events.

    Each tick must ask the same question as the first time. At the run's last checkpoint the command compares
    the policies, Adam's state, dataset X and the rest of the checkpoint bit for bit.

    The command only reads, so a run that a worker is training can be replayed too.

    Exit codes: 0 equal; 1 not equal; 2 the run cannot be replayed here; 130 stopped by Ctrl-C.

    Example: parenting replay 3
    """
    with exit_on_interrupt(), friendly_errors(), database() as db:
        get_run(db, run)  # torch takes a second to load, so an unknown run is refused before
        from parenting._process import settle
        from parenting.server.replay import relive

        settle()
        with bar("ticks") as show:
            relived = relive(db, run, show)
    say(_as_json(relived) if as_json else said(relived))
    raise typer.Exit(0 if relived.equal else 1)


def said(found: Relived) -> str:
    """Return the result of a replay in a sentence or two."""
    counts = (counted(found.tick, "tick"), counted(found.answers, "answer"), counted(found.events, "event"))
    lived = f"Run {found.run}: {', '.join(counts)} replayed."
    if found.parted:
        return f"{lived} Not equal. {found.parted}"
    if found.differ:
        names = dict.fromkeys(_piece(name) for name in found.differ)
        return f"{lived} Not equal. After tick {found.tick} these differ: {', '.join(names)}."
    if found.erased is not None and found.tick < found.checkpoint and found.tick == found.erased - 1:
        return (
            f"{lived} Equal questions. The answer of tick {found.erased} was erased: no replay goes further."
        )
    if found.until is not None and found.tick < found.checkpoint:
        return f"{lived} Equal questions. From tick {found.until + 1} on another machine raised it."
    return f"{lived} Equal bit for bit."


def _piece(name: str) -> str:
    """Return the name of a piece of state, by the longest beginning that `PIECES` knows."""
    parts = name.split(".")
    beginnings = [".".join(parts[:end]) for end in range(len(parts), 0, -1)]
    return next((PIECES[start] for start in beginnings if start in PIECES), name)


def _as_json(found: Relived) -> str:
    """Pieces of state have the names that `--json` has given them since version 0.1."""
    from parenting.agent.state import RENAMED

    former = {new: old for old, new in RENAMED.items()}
    names = ("run", "equal", "tick", "checkpoint", "answers", "events", "parted")
    differ = [former.get(name, name) for name in found.differ]
    return json.dumps({**{name: getattr(found, name) for name in names}, "differ": differ})
