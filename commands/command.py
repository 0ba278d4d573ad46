"""The class of every command: its help wraps as wide as the terminal, and a wrong value has its sentence."""

from __future__ import annotations

import inspect
import os
import sys
from io import TextIOWrapper
from typing import Any

import typer
from pydantic import ValidationError
from typer.core import TyperCommand

from parenting.commands.errors import friendly_errors, tell
from parenting.envs.people_text import printable
from parenting.server.environment import warnings
from parenting.server.lifeline import VARIABLE
from parenting.server.settings import FILE, names


class Command(TyperCommand):
    """A command whose messages name the option, the value and what is accepted."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments.

        Raises:
            BadParameter: one is wrong.
        """
        try:
            rest = super().parse_args(ctx, args)
            for option in self.params:
                _require_text(ctx, option)
            return rest
        except typer.BadParameter as error:
            if isinstance(error.__cause__, ValidationError):
                error.message = _sentence(error.param, error.__cause__)
            error.message = printable(error.message)
            raise

    def invoke(self, ctx: Any) -> Any:
        """Run the command, after a word on settings that cannot be meant as they are written.

        The processes that `parenting up` starts leave that to it.
        """
        if VARIABLE not in os.environ:
            with friendly_errors(self.name or ""):
                for said in warnings(os.environ, FILE, names()):
                    tell(said, self.name or "", "warning")
        return super().invoke(ctx)


def _require_text(ctx: Any, option: Any) -> None:
    """Refuse bytes that are not text, which stand in it as halves of surrogate pairs. A path may have them.

    Raises:
        BadParameter: the value of an option or argument has some.
    """
    value = ctx.params.get(option.name)
    for text in value if isinstance(value, list | tuple) else [value]:
        if isinstance(text, str) and any("\ud800" <= one <= "\udfff" for one in text):
            said = f"'{text}' holds bytes that are not text. Write it in UTF-8."
            raise typer.BadParameter(said, ctx=ctx, param=option)


def open_closed() -> None:
    """Put something in the place of a closed stream, whose number a file of data would get otherwise.

    Reading the input and writing to the output are errors of the system then; messages have no place.
    """
    modes = (("stdin", os.O_WRONLY, "r"), ("stdout", os.O_RDONLY, "w"), ("stderr", os.O_WRONLY, "w"))
    for name, flags, mode in modes:
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, flags), mode, encoding="utf-8"))


def replace_unprintable() -> None:
    """Let output go on where the terminal's encoding lacks a character: a question mark stands for it."""
    for stream in (sys.stdout, sys.stderr):
        if not isinstance(stream, TextIOWrapper) or stream.errors == "backslashreplace":
            continue
        if stream.errors == "strict" or "utf" not in stream.encoding.lower():
            stream.reconfigure(errors="replace")


def paragraphs(text: str) -> str:
    """Join the lines of each paragraph, which the terminal wraps at its own width; brackets stay brackets."""
    told = "\n\n".join(" ".join(part.split()) for part in inspect.cleandoc(text).split("\n\n"))
    if "[" not in told:
        return told
    from rich.markup import escape  # else rich takes them for markup, and they vanish

    return str(escape(told))


def _sentence(option: Any, error: ValidationError) -> str:
    """Say what an option accepts, in place of pydantic's words.

    Args:
        option: The option or argument, with its bounds `min` and `max`.
        error: The reason why its value is refused.
    """
    first = error.errors()[0]
    value, kind = first["input"], first["type"]
    if kind.startswith(("int_", "float_", "greater_than", "less_than", "finite_")):
        number = "whole number" if option.type_descriptor.annotation in (int, int | None) else "number"
        return f"'{value}' is not a {number}{_bounds(option.min, option.max)}."
    if kind == "value_error":  # typer's own sentence names the value
        return str(first["msg"]).removeprefix("Value error, ")
    return f"'{value}': {first['msg']}."


def _bounds(least: float | None, most: float | None) -> str:
    if least is None:
        return "" if most is None else f" up to {most}"
    return f" of at least {least}" if most is None else f" from {least} to {most}"
