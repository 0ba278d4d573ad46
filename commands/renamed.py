"""Options by the names that the version before this one had: accepted once more, with a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from parenting.commands.printing import say

RENAMED: Mapping[str, Mapping[str, str]] = {
    "answer": {"--ledger": "--receipts", "--patience": "--timeout"},
    "pretrain": {"--again": "--force"},
}
"""Command -> old option -> new option. An entry goes with the version after the one that renamed it."""


def modern(command: str, arguments: Sequence[str]) -> list[str]:
    """Replace the old options among a command's arguments, and say so on standard error."""
    names = RENAMED.get(command, {})
    return [_modern(argument, names) for argument in arguments]


def _modern(argument: str, names: Mapping[str, str]) -> str:
    option, equals, value = argument.partition("=")
    if option not in names:
        return argument
    say(f"{option} is now {names[option]}; the old name will go with the next version.", err=True)
    return f"{names[option]}{equals}{value}"
