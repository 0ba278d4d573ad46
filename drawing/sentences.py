"""Sentences that people read, in the reader's language: gettext, by a catalogue that the context holds.

A sentence is written in English where it is needed, as `tr("{name} passes here.", name=name)`, and is its own
key in the catalogue. Where no catalogue is in use (commands, scripts, stored data) it stays as it is written.
`make catalogue` collects all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from gettext import NullTranslations

ENGLISH = NullTranslations()
"""The language that the sentences are written in."""

_reader: ContextVar[NullTranslations] = ContextVar("reader", default=ENGLISH)


@contextmanager
def reading_in(catalogue: NullTranslations) -> Iterator[None]:
    """Use a catalogue for what is said within the block, and in threads that are given its context."""
    token = _reader.set(catalogue)
    try:
        yield
    finally:
        _reader.reset(token)


def tr(sentence: str, **values: object) -> str:
    """Return a sentence in the reader's language, with its values in their places."""
    said = _reader.get().gettext(sentence) if sentence else ""  # "" is the key of a catalogue's own header
    return said.format(**values) if values else said


def trn(one: str, many: str, count: int, **values: object) -> str:
    """Return the sentence for this number of things, which is `count` in it."""
    return _reader.get().ngettext(one, many, count).format(count=count, **values)


def mark(sentence: str) -> str:
    """Return a sentence as it is. It is in the catalogue, and translated where it is shown."""
    return sentence


def markn(one: str, many: str) -> tuple[str, str]:
    """Return both forms of a counted sentence as they are, for `trn`."""
    return one, many
