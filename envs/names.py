"""Names that there are not: the error lists those that there are, and the nearest. No torch here."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class UnknownNameError(ValueError):
    """There is no world, level or option of that name.

    The sentence names the nearest one, where one is near, and lists all.
    """

    def __init__(self, what: str, name: str, known: Iterable[str], of: str = "") -> None:
        """Write the sentence.

        Args:
            what: What is named, in the singular, such as "world".
            name: The name that was given.
            known: The names that there are.
            of: Whose names they are, if not everybody's.
        """
        names = list(known)
        where = f" of {of}" if of else ""
        listed = ", ".join(names) or "none"
        super().__init__(
            f"There is no {what} '{name}'{where}.{did_you_mean(name, names)} The {what}s are: {listed}."
        )


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a question that names the nearest of some names, after a space; nothing where none is near."""
    near = get_close_matches(name, list(known), 1)
    return f" Did you mean '{near[0]}'?" if near else ""
