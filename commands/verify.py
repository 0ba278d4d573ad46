"""`parenting verify`: check a stored run's answers, its bits and its X, and say where they part."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer

from parenting._plural import counted
from parenting.commands import replay
from parenting.commands.database import database
from parenting.commands.errors import exit_on_interrupt, friendly_errors
from parenting.commands.options import RunNumber
from parenting.commands.printing import say
from parenting.commands.progress import bar
from parenting.server.runs import get_run

if TYPE_CHECKING:
    from parenting.server.chain import Checked
    from parenting.server.verify import Verified

SHOWN = 20
"""Problems of the chain that are printed; `--json` has all."""


def verify(
    run: RunNumber,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON and nothing else.")
    ] = False,
) -> None:
    """Verify a stored run up to its last good checkpoint.

    Three things are checked. The chain of hashes over its answers: none was changed, removed or put in
    another order since it was stored. Its bits: the run is replayed, and the tick or the piece of state is
    named where they part. Dataset X: it is what the recorded answers make it. Bits depend on the machine;
    where another one raised the run, or a part of it, the command says so and leaves those out.

    The command only reads, so a run that a worker is training can be verified too.

    Exit codes: 0 nothing was found; 1 something was; 2 the run cannot be verified; 130 stopped by Ctrl-C.

    Example: parenting verify 3
    """
    with exit_on_interrupt(), friendly_errors(), database() as db:
        get_run(db, run)  # torch takes a second to load, so an unknown run is refused before
        from parenting._process import settle
        from parenting.server.verify import verify as verified

        settle()
        with bar("ticks") as show:
            found = verified(db, run, show)
    say(_as_json(found) if as_json else "\n".join(_said(found)))
    raise typer.Exit(0 if found.sound else 1)


def _said(found: Verified) -> list[str]:
    chain = found.chain
    lines = [f"Run {found.run}: {counted(chain.answers, 'answer')}; the chain of hashes {_state(chain)}."]
    lines += [f"  {problem}" for problem in chain.problems[:SHOWN]]
    if chain.erased:
        lines.append(f"  {chain.erased} erased: their content is gone, their place in the chain holds.")
    if chain.migrated:
        lines.append(f"  {chain.migrated} are of an older version: unchanged since the migration.")
    if found.checkpoint is None:
        return [*lines, "It has no good checkpoint yet, so there are no bits and no X to compare."]
    if found.machine is not None:
        lines.append(found.machine)
    if found.replayed is not None:
        lines.append(replay.said(found.replayed))
    return [*lines, found.x or f"X is what the answers make it, up to tick {found.checkpoint}."]


def _state(chain: Checked) -> str:
    return f"has {counted(len(chain.problems), 'fault')}" if chain.problems else "holds"


def _as_json(found: Verified) -> str:
    bits = found.replayed
    compared = None if bits is None else {name: getattr(bits, name) for name in ("equal", "tick", "parted")}
    return json.dumps(
        {
            "run": found.run,
            "sound": found.sound,
            "chain": vars(found.chain),
            "checkpoint": found.checkpoint,
            "bits": None if bits is None else {**(compared or {}), "differ": list(bits.differ)},
            "machine": found.machine,
            "x": found.x,
        }
    )
