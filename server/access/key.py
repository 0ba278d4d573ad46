"""The key file of the data folder, by which commands of the same user prove who they are.

The key itself is never sent: whoever listens at the port might be another user's program. A command sends a
proof instead, an HMAC of the port and the time, which is of use at this port alone and for five minutes.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import secrets
import time
from contextlib import suppress
from pathlib import Path

from parenting.server.errors import SetupError
from parenting.server.store.owner import give
from parenting.server.store.private import OTHERS

FILE = "access.key"
SECONDS = 300
"""Seconds by which the clocks of a proof and of its reader may differ."""
_FORM = re.compile(r"local\.([0-9]{1,12})\.([0-9a-f]{64})")


def make_key(folder: Path) -> bytes:
    """Return the key of a data folder; draw one where there is none.

    Raises:
        SetupError: the file cannot be read or made, or others may read it.
    """
    path = folder / FILE
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            _write(path)
        if path.stat().st_mode & OTHERS:
            path.chmod(0o600)
    except OSError as error:
        raise SetupError(f"{path} cannot be made: {error.strerror}. Make the data folder writable.") from None
    found = read_key(folder)
    if found is None:
        raise SetupError(f"{path} cannot be read, or is empty. Delete it; the next start makes another one.")
    return found


def _write(path: Path) -> None:
    """Write a new key: whole at once, and never over one that another process has just written."""
    fresh = path.with_name(f"{FILE}.{os.getpid()}.{secrets.token_hex(4)}")
    fd = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        give(fresh)
        with os.fdopen(fd, "w", encoding="ascii") as file:
            file.write(secrets.token_hex(32))
        with suppress(FileExistsError):
            os.link(fresh, path)
    finally:
        fresh.unlink()


def read_key(folder: Path) -> bytes | None:
    """Return the key of a data folder; None where there is none that this user can read."""
    try:
        return (folder / FILE).read_bytes().strip() or None
    except OSError:
        return None


def proof(key: bytes, port: int, now: float | None = None) -> str:
    """Return the proof that this user has the key, for the server at a port (`Authorization: Bearer ...`)."""
    seconds = int(time.time() if now is None else now)
    return f"local.{seconds}.{_sign(key, port, seconds)}"


def holds(key: bytes, port: int | None, text: str, now: float | None = None) -> bool:
    """Return whether a text is a proof for this port and for the present time."""
    found = _FORM.fullmatch(text)
    if found is None or port is None:
        return False
    seconds = int(found[1])
    fresh = abs((time.time() if now is None else now) - seconds) <= SECONDS
    return hmac.compare_digest(found[2], _sign(key, port, seconds)) and fresh


def _sign(key: bytes, port: int, seconds: int) -> str:
    return hmac.new(key, f"parenting access {port} {seconds}".encode(), hashlib.sha256).hexdigest()
