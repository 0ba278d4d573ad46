"""Logs: no text that came from outside steers a terminal or pretends to be a line of its own."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import structlog

from parenting.server.settings import Settings
from tests.server.test_log import log_as_before, logged

__all__ = ["log_as_before"]

log = structlog.get_logger()

FORGED = "\n2026-01-01T00:00:00Z [error    ] forged"
HOSTILE = [
    f"one{FORGED}",
    f"one\r{FORGED}",
    "\x1b[2J\x1b]0;title\x07",
    "\x9b31m",
    "a\u2028b\u2029c\u0085d\x0be",
    "\u202egnp.exe",
    "\x00\x7f",
    "\udc80",
    '{"message": "forged"}\n{"message": "forged"}',
]
STEERING = set("\x00\x07\x0b\x1b\r\x7f\x85\x9b\u2028\u2029\u202e\udc80")


@contextmanager
def unreported() -> Iterator[None]:
    """Keep these texts out of pytest's reports: half a surrogate pair ends the processes of xdist."""
    root = logging.getLogger()
    reporting = [handler for handler in root.handlers if type(handler).__module__ == "_pytest.logging"]
    for handler in reporting:
        root.removeHandler(handler)
    yield
    for handler in reporting:
        root.addHandler(handler)


def write_all(text: str) -> None:
    """Log a text in every place that takes one."""
    with unreported():
        log.warning(text)
        log.warning("event", why=text)
        logging.getLogger("uvicorn.error").error("library: %s", text)
        try:
            raise ValueError(text)
        except ValueError:
            log.exception("failed")


@pytest.mark.parametrize("text", HOSTILE)
def test_in_text_a_message_is_one_line_and_a_traceback_is_indented(tmp_path: Path, text: str) -> None:
    file = logged(Settings(data=tmp_path), log_format="text")
    write_all(text)
    written = file.read_bytes().decode()
    assert not STEERING & set(written)
    begun = [line for line in written.split("\n") if line and not line.startswith(("    ", "Traceback"))]
    assert len(begun) == 4, begun
    assert all("[warning" in line or "[error" in line for line in begun)


@pytest.mark.parametrize("text", HOSTILE)
def test_as_json_a_message_is_one_document_on_one_line(tmp_path: Path, text: str) -> None:
    file = logged(Settings(data=tmp_path))
    write_all(text)
    written = file.read_bytes().decode()
    assert not STEERING & set(written)
    found = [json.loads(line) for line in written.split("\n") if line]
    assert [one["message"] for one in found] == [text, "event", f"library: {text}", "failed"]
