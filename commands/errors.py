"""Errors of commands end with a sentence on standard error and an exit code, never with a traceback."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import typer
from pydantic import ValidationError

from parenting.agent.config import UnknownPresetError
from parenting.commands.printing import say
from parenting.envs.installed import BrokenPackageError
from parenting.envs.levels.spec import LevelError
from parenting.envs.names import UnknownNameError
from parenting.server.errors import ServerError
from parenting.server.settings import Settings
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


@contextmanager
def friendly_errors() -> Iterator[None]:
    """Print an error of the user's as a sentence, and exit with 2."""
    try:
        yield
    except ServerError as error:
        say(error.message, err=True)
        raise typer.Exit(2) from None
    except SENTENCES as error:
        say(str(error), err=True)
        raise typer.Exit(2) from None


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
