"""The options `--from-policy` and `--from-answers` of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from parenting.commands.errors import UsageError
from parenting.weights.origin import Origin, UnreadableOriginError, read_origin

FromPolicy = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Begin with the weights of this policy.", show_default="none"),
]
FromAnswers = Annotated[
    Path | None,
    typer.Option(
        metavar="EXPORT",
        help="Begin with X of the answers of an export that stand.",
        show_default="none",
    ),
]


def begins_with(from_policy: Path | None, from_answers: Path | None) -> Origin:
    """Read the files that a run should begin with.

    Raises:
        UsageError: one of them cannot be read, or is of something else.
    """
    try:
        return read_origin(from_policy, from_answers)
    except UnreadableOriginError as error:
        raise UsageError(f"--{error.field.replace('_', '-')}: {error}") from None
