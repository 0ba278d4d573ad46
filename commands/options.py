"""Parsers of option values, whose errors name the value and what is accepted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import typer

AfterFd = Annotated[
    int | None, typer.Option(hidden=True, help="A pipe that `parenting up` closes once the tables are there.")
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
