"""The settings' file `.env` and the names of settings in the environment: what cannot be read or is misspelt.

A file that is not UTF-8 text is refused with a sentence. A name that is not a setting is not an error, since
other programs share the environment, but it is told with the nearest setting: it may be a slip.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from io import StringIO
from pathlib import Path

from dotenv.parser import parse_stream
from pydantic_settings import DotEnvSettingsSource

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
SAVE_AGAIN = "Save it as UTF-8, in an editor or by: iconv -f"


class EnvironmentFile(DotEnvSettingsSource):
    """The settings of a file of lines `NAME=value`."""

    def _read_env_file(self, file_path: Path) -> Mapping[str, str | None]:
        read(file_path)
        logging.getLogger("dotenv.main").setLevel(
            logging.ERROR
        )  # `warnings` tells it, once and with the file
        return super()._read_env_file(file_path)


def read(file: Path) -> str:
    """Return the text of a file of settings, with or without a byte order mark; empty where there is none.

    Raises:
        SetupError: the file cannot be read, or is not text in UTF-8.
    """
    if not file.is_file():
        return ""  # a folder of this name may be somebody's virtual environment
    try:
        stored = file.read_bytes()
    except OSError as error:
        raise SetupError(f"{file.absolute()} cannot be read: {error.strerror}.") from None
    if stored.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in stored:
        raise SetupError(
            f"{file.absolute()} cannot be read: it is not UTF-8 text, but looks like UTF-16. "
            f"{SAVE_AGAIN} UTF-16 -t UTF-8"
        )
    try:
        return stored.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, byte = stored.count(b"\n", 0, error.start) + 1, stored[error.start]
        raise SetupError(
            f"{file.absolute()} cannot be read: line {line} is not UTF-8 text (byte 0x{byte:02x}). "
            f"{SAVE_AGAIN} LATIN1 -t UTF-8"
        ) from None


def warnings(environment: Iterable[str], file: Path, settings: Iterable[str]) -> list[str]:
    """Return a sentence for each line that cannot be read, and for each name that is nearly a setting.

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
    return [UNREAD.format(line.original.line, file.absolute()) for line in lines if line.error] + said


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
