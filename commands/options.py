"""Parsers of option values, whose errors name the value and what is accepted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from parenting.commands.errors import friendly_errors
from parenting.drawing.sentences import mark
from parenting.server.errors import NotFound

RunOrRuns = TypeVar("RunOrRuns")

AfterFd = Annotated[
    int | None, typer.Option(hidden=True, help="A pipe that `parenting up` closes once the tables are there.")
]

LARGEST = 2**63 - 1
"""The largest number that a column of the database holds."""


def of_a_run(number: RunOrRuns) -> RunOrRuns:
    """Take a run's number, or several, as they are given.

    Raises:
        Exit: one is larger than any that a run can have.
    """
    with friendly_errors():
        for one in number if isinstance(number, list) else [number]:
            if isinstance(one, int) and one > LARGEST:
                raise NotFound(mark("There is no run {run}."), run=one)
    return number


RunNumber = Annotated[
    int, typer.Argument(min=1, callback=of_a_run, help="A run's number; `parenting runs` lists them.")
]

AnyRunNumber = Annotated[
    int, typer.Argument(min=1, callback=of_a_run, help="A run's number; `parenting runs --all` lists them.")
]

Public = Annotated[
    bool | None,
    typer.Option(
        "--public",
        help="Others reach the pages, under the names of PARENTING_HOSTS and by way of a proxy that "
        "terminates TLS (docs/operations.md). Plain http is refused.",
        show_default=False,
    ),
]


def whole(least: int, most: int) -> Callable[[str | int], int]:
    """Make a parser of whole numbers from `least` to `most`."""

    def read(text: str | int) -> int:
        try:
            number = int(text)
        except ValueError:
            number = least - 1
        if not least <= number <= most:
            raise typer.BadParameter(f"'{text}' is not a whole number from {least} to {most}.")
        return number

    return read


def among(words: Sequence[str]) -> Callable[[str], str]:
    """Make a parser of one of some words."""

    def read(text: str) -> str:
        if text not in words:
            raise typer.BadParameter(f"'{text}' is not one of: {', '.join(words)}.")
        return text

    return read


def folder(text: str | Path) -> Path:
    """Parse a folder that exists or can be made."""
    if not str(text):
        raise typer.BadParameter("'' is not a folder: the name is empty. Use '.' for the current folder.")
    path = Path(text)
    there = next((one for one in (path, *path.absolute().parents) if one.exists()), path)
    if there.is_file():
        raise typer.BadParameter(f"'{text}' is not a folder: {there} is a file. Name another one.")
    return path
