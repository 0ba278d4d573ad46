"""Secrets of sessions and tokens: 256 random bits behind a prefix that tells the kind."""

from __future__ import annotations

import hashlib
import re
import secrets
from typing import Literal

Kind = Literal["opening", "program", "link", "session"]
PREFIXES: dict[Kind, str] = {"opening": "po_", "program": "pt_", "link": "pl_", "session": "ps_"}
"""The prefix of each kind: a scanner for leaked secrets finds them, and a wrong kind is refused unread."""
BYTES = 32
_FORM = re.compile(r"p[otls]_[A-Za-z0-9_-]{43}")


def draw(kind: Kind) -> str:
    """Draw a new secret from the system's source of randomness."""
    return PREFIXES[kind] + secrets.token_urlsafe(BYTES)


def kind_of(text: str) -> Kind | None:
    """Return the kind that a text is a secret of; None if no secret looks like it."""
    if _FORM.fullmatch(text) is None:
        return None
    return next(kind for kind, prefix in PREFIXES.items() if text.startswith(prefix))


def digest(secret: str) -> str:
    """Return the SHA-256 of a secret in hex, as the database stores it.

    No salt and no slow hash: the secret is random, so nothing that is cheaper than a guess finds it.
    """
    return hashlib.sha256(secret.encode()).hexdigest()
