"""`parenting worlds import`: levels of ours from maps of other collections."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from parenting.commands.errors import UsageError, friendly_errors, reason
from parenting.commands.level_file import read_text
from parenting.commands.options import among, folder
from parenting.commands.printing import say
from parenting.envs import registry
from parenting.envs.foreign_import import ForeignMapError, Imported, imported
from parenting.envs.foreign_text import FORMATS


def command(
    file: Annotated[str, typer.Argument(metavar="FILE|-", help="A file with maps; - reads standard input.")],
    form: Annotated[
        str | None,
        typer.Option(
            "--format",
            parser=among(tuple(FORMATS)),
            metavar="|".join(FORMATS),
            help="The maps' format.",
            show_default="found by its signs",
        ),
    ] = None,
    world: Annotated[
        str | None, typer.Option(help="The world of art of gridworlds.", show_default="found by its signs")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", parser=folder, help="Write each level to a file in this folder."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """Make levels of maps of other collections, and say what could not be carried over.

    It reads Sokoban's XSB, maps of Gymnasium's FrozenLake, CliffWalking and Taxi, and art of DeepMind's AI
    safety gridworlds, as text or as lists of strings in Python. The levels go to standard output, as
    `parenting run --level` takes them.

    Exit codes: 0 every level keeps the rules of its world; 1 one does not, which is said; 2 there is no map.

    Example: parenting worlds import lake.map > lake.txt
    """
    with friendly_errors():
        if world is not None:
            registry.spec(world)
        text, _ = read_text("FILE", file)
        found = _imported(text, file, form, world)
        if out is not None:
            _write(out, found)
    if as_json:
        say(json.dumps({"levels": [one.plain for one in found]}, indent=2))
    else:
        say("\n".join(one.level.text for one in found), nl=False)
        for one in found:
            for sentence in (*one.lost, *([one.refused] if one.refused else [])):
                say(f"{one.level.name}: {sentence.removesuffix('.')}.", err=True)
    if any(one.refused for one in found):
        raise typer.Exit(1)


def _imported(text: str, file: str, form: str | None, world: str | None) -> list[Imported]:
    """Every map of a text as a level.

    Raises:
        UsageError: there is no map, or one holds what no world of ours has.
    """
    stem = "map" if file == "-" else Path(file).stem or "map"
    try:
        return imported(text, stem, form, world)
    except ForeignMapError as error:
        place = "" if error.line is None else f", line {error.line}"
        raise UsageError(f"FILE: {file}{place}: {error}") from None


def _write(out: Path, found: Sequence[Imported]) -> None:
    """Write each level to a file named after it.

    Raises:
        UsageError: one of the files is there already, or cannot be written.
    """
    names = [re.sub(r"[^\w-]+", "-", one.level.name).strip("-") for one in found]
    files = [out / f"{number:03}-{name}.txt" for number, name in enumerate(names, 1)]
    for file in files:
        if os.path.lexists(file):
            raise UsageError(f"--out: {file} is there already. Remove it, or name another folder.")
    try:
        out.mkdir(parents=True, exist_ok=True)
        for file, one in zip(files, found, strict=True):
            with file.open("x", encoding="utf-8") as written:
                written.write(one.level.text)
    except OSError as error:
        raise UsageError(f"--out: {out} cannot be written to: {reason(error)}.") from None
