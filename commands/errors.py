"""Errors of commands end with a sentence on standard error and an exit code, never with a traceback."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Literal

import typer
from pydantic import ValidationError

from parenting.agent.config import UnknownPresetError
from parenting.commands.printing import say
from parenting.envs.installed import BrokenPackageError
from parenting.envs.levels.spec import LevelError
from parenting.envs.names import UnknownNameError
from parenting.server.errors import ServerError
from parenting.server.settings import Settings, logs_json
from parenting.weights.store import NoWeightsError


class UsageError(ValueError):
    """An option is wrong; the sentence names it, its value and the remedy."""


SENTENCES = (
    UsageError,
    UnknownPresetError,
    UnknownNameError,
    BrokenPackageError,
    LevelError,
    NoWeightsError,
)
"""The errors of a user that say by themselves what is wrong."""


LOGGING = ("up", "web", "worker")
"""The commands whose standard error is a log."""


@contextmanager
def friendly_errors(command: str = "") -> Iterator[None]:
    """Print an error of the user's as a sentence, and exit with 2.

    Args:
        command: The command; the sentence of one that logs is in the form of its log.
    """
    try:
        yield
    except ServerError as error:
        tell(error.message, command)
        raise typer.Exit(2) from None
    except SENTENCES as error:
        tell(str(error), command)
        raise typer.Exit(2) from None


def tell(text: str, command: str, level: Literal["error", "warning"] = "error") -> None:
    """Print a sentence on standard error: as a line of JSON where the command's log is."""
    if command not in LOGGING or not logs_json():
        say(text, err=True)
        return
    import structlog

    from parenting.server.log import set_up_log

    set_up_log(Settings.model_construct(log_format="json"), command)
    getattr(structlog.get_logger(), level)(text)


def reason(error: OSError | ValueError) -> str:
    """Return why a file cannot be used, without the system's number and the file's name."""
    return str(getattr(error, "strerror", None) or error)


@contextmanager
def exit_on_interrupt(said: str = "Stopped.") -> Iterator[None]:
    """On Ctrl-C, say that the command was stopped, and exit with 130, as a shell does."""
    try:
        yield
    except KeyboardInterrupt:
        say(said, err=True)
        raise typer.Exit(130) from None


def settings(**given: Any) -> Settings:
    """Read the settings from the environment, `.env` and the options given (None: not given).

    Call it within `friendly_errors`.

    Raises:
        ServerError: names each wrong setting.
    """
    try:
        return Settings(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        raise ServerError("\n".join(_wrong(item, given) for item in error.errors())) from None


def _wrong(item: Any, given: Mapping[str, Any]) -> str:
    """Name a wrong setting as the user gave it: as an option or as a variable of the environment."""
    name = str(item["loc"][0])
    option = given.get(name) is not None
    where = f"--{name.replace('_', '-')}" if option else f"PARENTING_{name.upper()}"
    about = Settings.model_fields[name].description
    return f"{where}: '{item['input']}' is wrong: {item['msg'].removeprefix('Value error, ')}. {about}"
