"""Trackers by name: `csv:FOLDER`, `jsonl:FOLDER`, `tensorboard:FOLDER`, or `MODULE:NAME` of one's own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from importlib import import_module

from parenting.server.trackers.feed import Feed, Feeds
from parenting.server.trackers.services import TensorBoardTracker
from parenting.server.trackers.tracker import Tracker
from parenting.server.trackers.writers import CsvTracker, JsonLinesTracker

WRITERS: Mapping[str, Callable[[str], Tracker]] = {
    "csv": CsvTracker,
    "jsonl": JsonLinesTracker,
    "tensorboard": TensorBoardTracker,
}
"""The trackers that write into a folder, by name."""
FORMS = "csv:FOLDER, jsonl:FOLDER, tensorboard:FOLDER, or MODULE:NAME of a tracker of your own"


class UnknownTrackerError(ValueError):
    """There is no such tracker; the sentence says which there are."""


def tracker(text: str) -> Tracker:
    """Return the tracker that a text names; that of a module is called without arguments if it is a function.

    Raises:
        UnknownTrackerError: it names none, or it cannot be loaded.
    """
    kind, colon, rest = text.strip().partition(":")
    if not colon or not kind or not rest:
        raise UnknownTrackerError(f"'{text}' is not a tracker. Write {FORMS}.")
    try:
        if kind in WRITERS:
            return WRITERS[kind](rest)
        found = getattr(import_module(kind), rest)
        made = found() if callable(found) else found
    except ImportError as error:
        hint = " Install it: pip install 'parenting[tensorboard]'." if kind == "tensorboard" else ""
        raise UnknownTrackerError(f"'{text}' cannot be loaded: {error}.{hint}") from None
    except Exception as error:  # of somebody else's module
        raise UnknownTrackerError(f"'{text}' cannot be made: {error!r}.") from None
    return check(made, text)


def check(made: object, said: str) -> Tracker:
    """Return what is a tracker.

    Raises:
        UnknownTrackerError: it lacks one of the three methods.
    """
    if not isinstance(made, Tracker) or isinstance(made, type):
        raise UnknownTrackerError(f"{said} is not a tracker: it needs the methods begin, log and end.")
    return made


def feeds(chosen: Iterable[str | Tracker]) -> Feeds:
    """Return the feeds of trackers, each named by a text or given as an object.

    Raises:
        UnknownTrackerError: one of them is none.
    """
    made = [(one, tracker(one) if isinstance(one, str) else check(one, repr(one))) for one in chosen]
    return Feeds([Feed(found, one if isinstance(one, str) else "") for one, found in made])
