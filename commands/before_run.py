"""The option `--pretrain`: weights that a run lacks are made first, or it begins without (Sec. 3.1.4)."""

from __future__ import annotations

from pathlib import Path

import typer

from parenting.commands.errors import UsageError
from parenting.commands.options import among
from parenting.commands.pretrain import MAX_STEPS, make
from parenting.weights.estimate import seconds
from parenting.weights.store import Wanted

NOW, WITHOUT = "now", "without"
PRETRAIN = typer.Option(
    parser=among((NOW, WITHOUT)),
    metavar="now|without",
    help="Where pre-trained weights are missing for the level's size: make them first, or begin without.",
    show_default="ask for one of them",
)


def provide(wanted: Wanted, choice: str | None, folder: Path, *, quiet: bool) -> bool:
    """Make weights that are missing, if that was chosen; return whether they are there now.

    Raises:
        UsageError: Nothing was chosen; the sentence offers both.
        Exit: Pre-training was interrupted, or did not converge.
    """
    if choice is None:
        size, world = f"{wanted.height} x {wanted.width}", wanted.world.name
        raise UsageError(
            f"There are no pre-trained weights for {world} at {size}. Add --pretrain now to make them first,"
            f" as `parenting pretrain --world {world} --size {size.replace(' ', '')}` does (about"
            f" {seconds(wanted)} s), or --pretrain without to begin without."
        )
    if choice == NOW:
        make(wanted, folder, 0, MAX_STEPS, quiet=quiet)
    return choice == NOW
