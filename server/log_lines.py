"""Lines of the log: the request that they are about, the secrets that they hide, and how often they come."""

from __future__ import annotations

import logging
import re
import time
from collections.abc import Callable, Hashable, Mapping, MutableMapping
from contextvars import ContextVar
from typing import Any

from parenting.envs.people_text import printable

SECONDS = 1.0
"""A warning or an error that repeats is written once in this time."""
MOST_KEYS = 1000
HIDDEN = "***"
SECRET = re.compile(r"cookie|authorization|passw|secret|client_?id|session_?id|token$", re.IGNORECASE)
URL_PASSWORD = re.compile(r"(\w://[^\s:/@]*:)[^\s@/]+@")
NAMED = re.compile(r"(passw\w*|client_id|cookie)(['\"]?\s*[=:]\s*)['\"]?[^\s'\",&;)}\]]+", re.IGNORECASE)
PARAMETERS = re.compile(r"\[parameters: .*?\]$", re.DOTALL | re.MULTILINE)
"""The values of a statement, as SQLAlchemy's errors list them."""

Request = Mapping[str, Any]
request: ContextVar[Request | None] = ContextVar("request", default=None)
"""The ASGI scope of the request in hand; its path names a run or a question once it is routed."""


def about_request(_logger: Any, _name: str, line: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Add the ids of the request in hand, and of the run and the question that its address names."""
    scope = request.get()
    if scope is not None:
        found = scope.get("path_params", {})
        ids = {
            "request": scope.get("request_id"),
            "run": found.get("run_id"),
            "question": found.get("query_id"),
        }
        for name, value in ids.items():
            if value is not None:
                line.setdefault(name, value)
    return line


def hide_secrets(_logger: Any, _name: str, line: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Hide passwords, cookies and the ids of browsers, wherever they stand in a line."""
    return {name: _hidden(name, value) for name, value in line.items()}


def on_one_line(_logger: Any, _name: str, line: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Write what would steer a terminal or begin a line as escapes: no text can pretend to be a message.

    A traceback keeps its lines, each of which is indented; JSON needs none of this.
    """
    traceback = line.pop("exception", None)
    found = {name: _on_one_line(value) for name, value in line.items()}
    if isinstance(traceback, str):
        found["exception"] = printable(traceback).replace("\n", "\n    ")
    return found


def hidden(text: str) -> str:
    """Return a text without the secrets that can be recognised in it."""
    text = URL_PASSWORD.sub(rf"\1{HIDDEN}@", text)
    text = NAMED.sub(rf"\1\2{HIDDEN}", text)
    return PARAMETERS.sub(f"[parameters: {HIDDEN}]", text)


def _on_one_line(value: Any) -> Any:
    return printable(value, breaks=False) if isinstance(value, str) else value


def _hidden(name: str, value: Any) -> Any:
    if SECRET.search(name) and value is not None:
        return HIDDEN
    if isinstance(value, str):
        return hidden(value)
    if isinstance(value, Mapping):
        return {key: _hidden(str(key), part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_hidden("", part) for part in value]
    return value if value is None or isinstance(value, bool | int | float) else hidden(str(value))


class Limit(logging.Filter):
    """A filter that lets the same warning pass once a second and says how many came between."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self.clock = clock
        self._seen: dict[Hashable, tuple[float, int]] = {}  # when it was let through, how many were not since

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether a message is written; all below a warning are."""
        if record.levelno < logging.WARNING:
            return True
        key, now = _key(record), self.clock()
        since, held = self._seen.get(key, (now - SECONDS, 0))
        if now - since < SECONDS:
            self._seen[key] = since, held + 1
            return False
        if len(self._seen) >= MOST_KEYS:
            self._seen = {old: seen for old, seen in self._seen.items() if now - seen[0] < SECONDS}
        self._seen[key] = now, 0
        if held and isinstance(record.msg, dict):
            record.msg["repeated"] = held + record.msg.get("repeated", 0)  # of `log_limit`
        elif held:
            record.msg = f"{record.msg} (and {held} more)"
        return True


def _key(record: logging.LogRecord) -> Hashable:
    """Return what makes two messages the same: of one kind, about one run."""
    if isinstance(record.msg, dict):
        line = record.msg
        return record.levelno, str(line.get("event")), str(line.get("code")), str(line.get("run"))
    return record.levelno, record.name, str(record.msg)
