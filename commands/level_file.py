"""The option `--level`: a built-in level's name, a file with one level or several, a pipe, or a text."""

from __future__ import annotations

import sys
from errno import EBADF
from os.path import exists, isdir
from pathlib import Path

import typer

from parenting.commands.errors import UsageError, reason
from parenting.commands.printing import say
from parenting.envs import registry
from parenting.envs.level_bytes import FILE_BYTES, decode, name_by_file
from parenting.envs.level_text import SeveralLevelsError
from parenting.envs.levels.spec import Level

STANDARD_INPUT = "-"
LEVEL = typer.Option(
    metavar="NAME|FILE[:NUMBER|:NAME]|-",
    help="A built-in level, or a file with levels, of which one is chosen by number or name; - reads"
    " standard input.",
)


def chosen_level(world: str, name_or_file: str | None) -> Level:
    """A built-in level, or one from a file: a name that is not built in and exists as a file is one.

    What is cut from a text around its art is said on standard error.

    Raises:
        UsageError: it is neither, the file cannot be read as text, or holds several levels.
        UnknownNameError: there is no such world.
        LevelError: the file's level breaks a rule of its world.
    """
    if name_or_file is None or name_or_file in registry.spec(world).levels:
        return registry.level(world, name_or_file)
    if "\n" in name_or_file:
        return _said(registry.read_level(world, name_or_file), ())
    file, which = _parted(name_or_file)
    if file != STANDARD_INPUT and not exists(file):
        known = ", ".join(registry.spec(world).levels)
        raise UsageError(f"--level: '{name_or_file}' is neither a level of {world} ({known}) nor a file.")
    source = "standard input" if file == STANDARD_INPUT else file
    text, said = read_text("--level", file)
    try:
        return _said(registry.read_level(world, text, source, which, _name(Path(file))), said)
    except SeveralLevelsError as error:
        remedy = f"Choose one by its number or name, such as --level {file}:1"
        raise UsageError(f"--level: {str(error).removesuffix('.')}. {remedy}.") from None


def read_text(option: str, file: str) -> tuple[str, tuple[str, ...]]:
    """Return the text of a file, a pipe or, for `-`, standard input, and a word on its encoding.

    Raises:
        UsageError: It cannot be read as text; the sentence names the option.
    """
    try:
        return decode(_bytes(file))
    except (OSError, ValueError) as error:
        raise UsageError(f"{option}: {file} cannot be read as text: {reason(error)}.") from None


def _name(file: Path) -> str | None:
    """Return the name of a level in a file that names none; None of a pipe."""
    return name_by_file(file.stem) if file.is_file() else None


def _bytes(file: str) -> bytes:
    """Read a file, a byte more than is allowed at most.

    Raises:
        OSError: It cannot be read.
    """
    if file == STANDARD_INPUT:
        if sys.stdin.isatty():
            say("Type or paste a level; Ctrl-D ends it.", err=True)
        try:
            return sys.stdin.buffer.read(FILE_BYTES + 1)
        except OSError as error:
            raise OSError("it is closed" if error.errno == EBADF else str(error)) from None
    with Path(file).open("rb") as opened:
        return opened.read(FILE_BYTES + 1)


def _parted(text: str) -> tuple[str, str | None]:
    """Take FILE:WHICH apart behind the longest file that exists; its path and WHICH may hold colons."""
    if exists(text):
        return text, None
    parts = text.split(":")
    for count in range(len(parts) - 1, 0, -1):
        file, which = ":".join(parts[:count]), ":".join(parts[count:])
        if file == STANDARD_INPUT or (exists(file) and not isdir(file)):
            return file, which
    return text, None


def _said(level: Level, said: tuple[str, ...]) -> Level:
    for sentence in (*said, *level.said):
        say(f"{level.source}: {sentence}.", err=True)
    return level
