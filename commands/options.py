"""How options are read: what is wrong with one is said with its value and what would do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import typer


def whole(least: int, most: int) -> Callable[[str | int], int]:
    """Reads a whole number from `least` to `most`."""

    def read(text: str | int) -> int:
        try:
            number = int(text)
        except ValueError:
            number = least - 1
        if not least <= number <= most:
            raise typer.BadParameter(f"'{text}' is no whole number from {least} to {most}.")
        return number

    return read


def among(words: Sequence[str]) -> Callable[[str], str]:
    """Reads one of some words."""

    def read(text: str) -> str:
        if text not in words:
            raise typer.BadParameter(f"'{text}' is none of: {', '.join(words)}.")
        return text

    return read


def folder(text: str | Path) -> Path:
    """Reads a folder that is there, or can be made."""
    if not str(text):
        raise typer.BadParameter("'' names no folder. Write its path; a dot is the folder that you are in.")
    path = Path(text)
    there = next((one for one in (path, *path.absolute().parents) if one.exists()), path)
    if there.is_file():
        raise typer.BadParameter(f"'{text}' is no folder: {there} is a file. Name another one.")
    return path
