"""The settings' file `.env` and the names of settings in the environment: what cannot be read or is misspelt.

A file that cannot be read, or is not UTF-8 text, is refused with a sentence. A name that is not a setting is
not an error, since other programs share the environment, but it is told with the nearest setting: it may be
a slip.
"""

from __future__ import annotations

import logging
import os
from codecs import BOM_UTF16_BE, BOM_UTF16_LE, BOM_UTF32_BE
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from difflib import get_close_matches
from io import StringIO
from os.path import expanduser
from pathlib import Path
from stat import S_ISCHR, S_ISDIR, S_ISREG

from dotenv import dotenv_values
from dotenv.parser import Binding, parse_stream
from pydantic_settings import DotEnvSettingsSource

from parenting.envs.level_bytes import encoding_of
from parenting.server.errors import SetupError

PREFIX = "PARENTING_"
NO_SETTINGS = (
    "PARENTING_LIFELINE",
    "PARENTING_CHROMIUM",
    "PARENTING_FIREFOX",
    "PARENTING_TORTURE",
    "PARENTING_KILL_ROUNDS",
)
"""Variables that are read elsewhere: by the processes that `parenting up` starts, and by the tests."""
RENAMED = {
    "PARENTING_CONTAINER": "PARENTING_PUBLISHED_ON_LOOPBACK (docs/deployment.md)",
}
"""Settings of earlier versions, and what is used instead."""
NEAR = 0.85
"""The least likeness of a name without the prefix to that of a setting, so that it counts as misspelt."""
UNREAD = "Warning: line {} of {} is ignored: it is not NAME=value, or a quotation mark in it is not closed."
"""The warning of a line that cannot be read; the line itself may hold a secret."""
NO_VALUE = "Warning: line {} of {} is ignored: {} has no value. Write {}=VALUE."
"""The warning of a name alone."""
MOVE = "Put a file of settings there that you may read, or rename what is there."
"""The remedy for a file of settings that is none, or of another user's."""
SAVE_AGAIN = "Save it as UTF-8, in an editor or by: iconv -f"


class EnvironmentFile(DotEnvSettingsSource):
    """The settings of a file of lines `NAME=value`."""

    def _read_env_files(self) -> Mapping[str, str | None]:
        """Read the one file; pydantic-settings would pass over what is not a file in silence."""
        assert isinstance(self.env_file, Path)
        return self._read_env_file(self.env_file)

    def _read_env_file(self, file_path: Path) -> Mapping[str, str | None]:
        stored = values(file_path)
        return {name.lower(): self._home(name, value) for name, value in stored.items() if value != ""}

    def _home(self, name: str, value: str | None) -> str | None:
        """Return a folder with its ~ replaced as a shell replaces it, and any other value as it is."""
        field = self.settings_cls.model_fields.get(name.lower().removeprefix(PREFIX.lower()))
        is_folder = field is not None and field.annotation in (Path, Path | None)
        return expanduser(value) if value is not None and is_folder else value


def wanted(name: str, file: Path) -> str | None:
    """Return the value of one setting as it is written, even if others are wrong; None if it is not set."""
    found = {key.upper(): value for key, value in os.environ.items() if value}
    if name not in found:
        with suppress(SetupError):
            found |= {key.upper(): value for key, value in values(file).items() if value}
    return found.get(name)


def values(file: Path) -> dict[str, str | None]:
    """Return the names and values of a file of settings; a ${NAME} in a value stands for itself.

    Raises:
        SetupError: the file cannot be read, or is not text in UTF-8.
    """
    logging.getLogger("dotenv.main").setLevel(logging.ERROR)  # `warnings` tells it, once and with the file
    return dotenv_values(stream=StringIO(read(file)), interpolate=False)


def read(file: Path) -> str:
    """Return the text of a file of settings, with or without a byte order mark; empty where there is none.

    Raises:
        SetupError: the file cannot be read, or is not text in UTF-8.
    """
    stored = _bytes(file)
    encoding = encoding_of(stored)
    if encoding != "utf-8":
        name, marked = encoding[:6].upper(), stored.startswith((BOM_UTF16_LE, BOM_UTF16_BE, BOM_UTF32_BE))
        raise SetupError(
            f"{file.absolute()} cannot be read: it is not UTF-8 text, but looks like {name}. "
            f"{SAVE_AGAIN} {name if marked else name + encoding[-2:].upper()} -t UTF-8"
        )
    if b"\0" in stored:
        line = stored.count(b"\n", 0, stored.index(b"\0")) + 1
        raise SetupError(f"{file.absolute()} cannot be read: line {line} holds a NUL byte (0x00). Remove it.")
    try:
        return stored.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, byte = stored.count(b"\n", 0, error.start) + 1, stored[error.start]
        raise SetupError(
            f"{file.absolute()} cannot be read: line {line} is not UTF-8 text (byte 0x{byte:02x}). "
            f"{SAVE_AGAIN} LATIN1 -t UTF-8"
        ) from None


def _bytes(file: Path) -> bytes:
    """Return what a file of settings holds; nothing where there is none, or a virtual environment.

    Raises:
        SetupError: there is something else, or it cannot be read.
    """
    try:
        kind = os.stat(file).st_mode
        if S_ISREG(kind):
            return file.read_bytes()
        if S_ISCHR(kind) or (file / "pyvenv.cfg").is_file():
            return b""  # /dev/null, or a folder of Python's that has this name, too
        said = "it is a folder" if S_ISDIR(kind) else "it is not a file"
    except FileNotFoundError:
        if not file.is_symlink():
            return b""
        said = f"it is a link to {os.readlink(file)}, which is not there"
    except OSError as error:
        said = str(error.strerror)
    raise SetupError(f"{file.absolute()} cannot be read: {said}. {MOVE}")


def warnings(environment: Iterable[str], file: Path, settings: Iterable[str]) -> list[str]:
    """Return a sentence for each line that is not NAME=value, and for each name that is nearly a setting.

    Args:
        environment: The names of the environment's variables.
        file: The file of settings.
        settings: The names of the settings as variables.

    Raises:
        SetupError: the file cannot be read.
    """
    known, lines = list(settings), list(parse_stream(StringIO(read(file))))
    found = [(name, "in the environment") for name in environment]
    found += [(line.key, f"in {file.absolute()}") for line in lines if line.key is not None]
    said = [told for name, where in found if (told := _warning(name, where, known)) is not None]
    unread = [UNREAD.format(_number(line), file.absolute()) for line in lines if line.error]
    unread += [
        NO_VALUE.format(_number(line), file.absolute(), line.key, line.key)
        for line in lines
        if line.key is not None and line.value is None and line.key.upper() in known
    ]
    return unread + said


def _number(line: Binding) -> int:
    """Return the number of a line; the parser counts from the empty lines above it."""
    text = line.original.string
    return line.original.line + text[: len(text) - len(text.lstrip())].count("\n")


def _warning(name: str, where: str, known: Sequence[str]) -> str | None:
    upper = name.upper()
    if upper in known or upper in NO_SETTINGS:
        return None
    if upper in RENAMED:
        return f"Warning: {name} {where} is not a setting any more and is ignored. Use {RENAMED[upper]}."
    ours = upper.startswith(PREFIX)
    near = get_close_matches(upper, known, 1, cutoff=NEAR)
    if not near and not ours:
        return None
    hint = f" Did you mean {near[0]}?" if near else " docs/commands.md lists the settings."
    return f"Warning: {name} {where} is not a setting and is ignored.{hint}"
