"""Public ids of runs and questions: random, so that nobody guesses one and no two are ever equal.

An id is 22 characters of the base-58 alphabet, which leaves out what is easily confused (0 and O, I and l):
128.9 random bits. It stands in addresses and forms without being quoted, and a double click selects it whole.
A number has at most 16 digits, so the two are told apart by their length.
"""

from __future__ import annotations

import re
import secrets

ALPHABET = "123456789ABCDEFGHJKLMNPQRSTUVWXYZabcdefghijkmnopqrstuvwxyz"
LENGTH = 22
PATTERN = f"^[{ALPHABET}]{{{LENGTH}}}$"


def public_id() -> str:
    """Draw a new public id from the system's source of randomness."""
    return "".join(secrets.choice(ALPHABET) for _ in range(LENGTH))


def is_public_id(text: str) -> bool:
    """Return whether a text has the form of a public id."""
    return _FORM.fullmatch(text) is not None


_FORM = re.compile(PATTERN)
