"""The program `parenting`: a group of commands, each in its own file, loaded when the command is called.

So `parenting web` never loads torch, and `--help` is fast.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.metadata import version
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from parenting.commands.command import Command, open_closed, paragraphs, replace_unprintable
from parenting.commands.printing import say
from parenting.commands.renamed import modern
from parenting.envs.names import did_you_mean
from parenting.envs.people_text import printable

COMMANDS = {
    "up": "Start everything (migrate, web and workers) and open the pages in a browser.",
    "start": "Start a run in the database.",
    "run": "Train agents with a scripted parent, without a database.",
    "experiment": "Run the paper's experiments and compare its numbers with ours.",
    "pretrain": "Pre-train weights on random mazes.",
    "parents": "List the parents that answer by a rule, and their parameters.",
    "worlds": "List the worlds and their levels, print random levels, draw pictures.",
    "answer": "Answer a run as a scripted parent, over the HTTP API.",
    "runs": "List the runs, and who waits for whom.",
    "person": "List the people who answered, by pseudonym; delete one's data.",
    "resume": "Let a paused or failed run go on.",
    "rollback": "Go on from an earlier tick of a run, as a new run.",
    "export": "Write answers, metrics or the log of a run as JSON lines or CSV.",
    "import": "Add the runs of an export to the database.",
    "policy": "Write the present policy of a run to a file.",
    "replay": "Replay a stored run and compare it bit for bit.",
    "doctor": "Examine the installation, the data folder and the database.",
    "verify": "Verify a stored run's answers, bits and X.",
    "backup": "Write a checked copy of the database, while everything goes on.",
    "restore": "Put a backup in place of the database.",
    "copy": "Move a database from SQLite to PostgreSQL, or back.",
    "access": "List who may come in; open, create or revoke.",
    "web": "Serve the pages and the API.",
    "worker": "Train the agents of the runs in the database.",
    "workers": "List the workers that are alive, their runs, load and memory.",
    "migrate": "Bring the database's tables up to date.",
}
"""Each command with its help text. The command `up` is the function `up` in commands/up.py, and so on."""

MODULES = {"import": "import_runs"}
"""Commands whose names Python does not take for functions, and their functions."""

SUBCOMMANDS = {
    "access": {
        "open": "Print an address that lets a browser in.",
        "create": "Make a link for a person, or a token for a program.",
        "list": "List tokens, links and sessions.",
        "revoke": "End tokens, links and sessions.",
    },
    "worlds": {
        "new": "Write the skeleton of a package with a world of your own.",
        "import": "Make levels of maps of other collections.",
    },
    "runs": {
        "rename": "Give a run another name.",
        "describe": "Keep a description with a run.",
        "tag": "Add tags to a run, or take them away.",
        "archive": "Leave a run out of the list, or take it in again.",
        "delete": "Delete a run for good, after it was asked.",
        "deleted": "List what is left of deleted runs.",
    },
    "person": {
        "list": "List the people who answered.",
        "name": "Keep a person's name, or an id of another system.",
        "delete": "Delete one person's data for good, after it was asked.",
    },
}
"""Commands below a command, each with its help text. `worlds new` is the function `command`
in commands/worlds_new.py, and so on."""

EXAMPLES = """\
Examples:

parenting up

parenting run unsafe-exploration --preset conservative --trials 100

`parenting COMMAND --help` shows an example of each command.
"""

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)
"""The errors of a disk that takes no more of an output, and of an output that is closed."""


class LazyGroup(TyperGroup):
    """A group that imports a command's module when the command is called, not when it is listed."""

    def main(self, *args: Any, **named: Any) -> Any:
        """Run the program; no character of its output can end it, and a full disk ends it with a sentence."""
        open_closed()
        replace_unprintable()
        try:
            return super().main(*args, **named)
        except OSError as error:
            if error.errno == errno.ENAMETOOLONG:
                say(f"{error.filename} cannot be used: {error.strerror}. Give a shorter one.", err=True)
                sys.exit(2)
            if error.errno not in FULL:
                raise
            say(f"{error.filename or 'The output'} cannot be written: {error.strerror}.", err=True)
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is buffered has no place
            sys.exit(2)

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names in the order of `COMMANDS`."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command for the list, without its module; None if there is no such command."""
        return _command(cmd_name, _placeholder, COMMANDS[cmd_name]) if cmd_name in COMMANDS else None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Import the command that was called, and give its options their present names."""
        if not args or args[0].startswith("-"):
            return super().resolve_command(ctx, args)  # reports what is wrong
        name = args[0]
        if name not in COMMANDS:
            hint = did_you_mean(name, COMMANDS)
            ctx.fail(f"No such command '{printable(name)}'.{hint} `parenting --help` lists the commands.")
        if args[1:] and args[1] in SUBCOMMANDS.get(name, {}):
            return _below(name, args[1], args[2:])
        module = MODULES.get(name, name)
        function = getattr(import_module(f"parenting.commands.{module}"), module)
        return name, _command(name, function), modern(name, args[1:])


def _below(name: str, below: str, args: list[str]) -> tuple[str, Any, list[str]]:
    """Import a command that stands below another one."""
    function = import_module(f"parenting.commands.{name}_{below.replace('-', '_')}").command
    return f"{name} {below}", _command(f"{name} {below}", function), args


def _command(name: str, function: Callable[..., Any], help_text: str | None = None) -> Any:
    single = typer.Typer(add_completion=False)
    told = paragraphs(help_text or function.__doc__ or "")
    single.command(name, cls=Command, help=told)(function)
    return typer.main.get_command(single)


def _placeholder() -> None:
    """Do nothing: this stands for a command in the list."""


app = typer.Typer(
    cls=LazyGroup,
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_show_locals=False,
    epilog=EXAMPLES,
)


def _version(asked: bool) -> None:
    """Print the version and end, where it is asked for."""
    if asked:
        say(f"parenting {version('parenting')}")
        raise typer.Exit


@app.callback()
def parenting(
    show_version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Train agents safely from a parent's guidance and preferences, without a reward signal."""


if __name__ == "__main__":
    app()
