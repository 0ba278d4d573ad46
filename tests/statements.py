"""Statements that SQLAlchemy has compiled, kept for all engines of a process.

Each test connects to a database of its own. With a cache for each engine, a tenth of the time of the server's
tests went into compiling the same few hundred statements again.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import Engine
from sqlalchemy.util import LRUCache


class Statements(LRUCache[Any, Any]):
    """Keyed by the class of a dialect, and not by the dialect itself, of which each engine has one."""

    def get(self, key: Any, default: Any = None) -> Any:
        return super().get((type(key[0]), *key[1:]), default)

    def __setitem__(self, key: Any, compiled: Any) -> None:
        super().__setitem__((type(key[0]), *key[1:]), compiled)


_statements = Statements(2000)
_init = Engine.__init__


def share() -> None:
    """Let every engine that is made from now on use them."""

    def init(self: Engine, *args: Any, **options: Any) -> None:
        _init(self, *args, **options)
        self._compiled_cache = _statements

    Engine.__init__ = init  # type: ignore[method-assign]  # SQLAlchemy has no other place for it
