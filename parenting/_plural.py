"""Numbers of things in sentences for people."""

from __future__ import annotations


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, as in *1 run* and *2 runs*; the plural has to be regular."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
