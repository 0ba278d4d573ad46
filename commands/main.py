"""`parenting`: the commands by name, each in a file of its own that is loaded only when it is called.

So `parenting web` never loads torch, and `--help` is quick.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

from parenting.commands.renamed import modern

COMMANDS = {
    "up": "Start everything: migrate, web and worker; opens the pages in a browser.",
    "run": "Raise agents by a scripted parent, without database.",
    "experiment": "Run the paper's experiments: its numbers beside ours.",
    "pretrain": "Pre-train weights on random mazes.",
    "worlds": "List the worlds and their levels; print random ones; draw pictures.",
    "answer": "Answer a run as the scripted parent, over the HTTP API.",
    "runs": "List the runs, and who waits for whom.",
    "export": "Write the answers of a run as JSON lines.",
    "replay": "Live a stored run again, and compare it bit for bit.",
    "web": "Serve the pages and the API.",
    "worker": "Raise the agents of the database's runs.",
    "migrate": "Bring the database's tables up to date.",
}
"""Every command with its sentence. `up` is the function `up` in commands/up.py, and so on."""

EXAMPLES = """\
Examples:

parenting up

parenting run unsafe-exploration --preset conservative --trials 100

`parenting COMMAND --help` shows one for each command.
"""


class Lazy(TyperGroup):
    """A group that loads a command's file when the command is called, not to list it."""

    def list_commands(self, ctx: Any) -> list[str]:
        """The names, in the order of `COMMANDS`."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """One command as the list shows it, its file not loaded; None where there is none of that name."""
        return _command(cmd_name, _listed, COMMANDS[cmd_name]) if cmd_name in COMMANDS else None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that was called, loaded."""
        if not args or args[0] not in COMMANDS:
            return super().resolve_command(ctx, args)  # says that there is none, and what there is
        name = args[0]
        function = getattr(import_module(f"parenting.commands.{name}"), name)
        return name, _command(name, function), modern(name, args[1:])


def _command(name: str, function: Callable[..., Any], sentence: str | None = None) -> Any:
    one = typer.Typer(add_completion=False)
    one.command(name, help=sentence)(function)
    return typer.main.get_command(one)


def _listed() -> None:
    """Stands for a command in the list."""


app = typer.Typer(
    cls=Lazy, add_completion=False, no_args_is_help=True, pretty_exceptions_show_locals=False, epilog=EXAMPLES
)


@app.callback()
def parenting() -> None:
    """Safe reinforcement learning from a parent's guidance and preferences, without a reward signal."""


if __name__ == "__main__":
    app()
