"""Describe what the operator did to a run, and the probabilities that hold after it (agent.events)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from parenting.server import notes
from parenting.server.damage import damage
from parenting.server.pages.numbers import number
from parenting.server.tables import OperatorEvent, Run

PROBABILITIES = {
    "p_guid": "ask before a new move",
    "p_rec": "record a clip",
    "p_pref": "ask about two clips",
    "p_train": "train on X",
}
"""The probabilities that an operator may change, in the order of Sec. 2, and the event of each."""


NOTES = {
    "mature": "Ended the stage",
    "end_episode": "Ended the episode",
    "failed": "The run failed: {reason}",
    "resumed": "Resumed the run from its last good checkpoint",
    "checkpoint_damaged": "A damaged checkpoint was passed over: {reason}",
    "person_erased": "A person's data were deleted: {answers} answers left X; the weights knew them",
}


class LogEntry(NamedTuple):
    """One thing that the operator did, or that happened to the run."""

    what: str
    when: str


def log_entries(events: Sequence[OperatorEvent]) -> list[LogEntry]:
    """Return the log of a run, the last entry first."""
    return [_entry(event) for event in reversed(events)]


def probabilities(run: Run, events: Sequence[OperatorEvent]) -> dict[str, float]:
    """Return the probabilities by name as they hold once every event has applied."""
    sound = [event for event in events if damage(event) is None]
    changed = {event.payload["name"]: event.payload["value"] for event in sound if event.kind == "change"}
    return {name: changed.get(name, run.config[name]) for name in PROBABILITIES}


def _entry(event: OperatorEvent) -> LogEntry:
    found = damage(event)
    if found is not None:
        return LogEntry(f"This entry is damaged: {found}", "")
    return LogEntry(_what(event), _when(event))


def _what(event: OperatorEvent) -> str:
    if event.kind == "change":
        return f"Set {event.payload['name']} to {event.payload['value']:g}"
    entry = notes.read(event)
    if isinstance(entry, notes.MachineChanged):
        return f"The machine changed: {machine(entry.before)}, now {machine(entry.after)}"
    return NOTES[event.kind].format(**event.payload)


def machine(versions: Mapping[str, Any]) -> str:
    """Return in words what a run's bits depend on besides its record."""
    return ", ".join(f"{name} {value}" for name, value in versions.items())


def _when(event: OperatorEvent) -> str:
    return "before the next tick" if event.applied_tick is None else f"at tick {number(event.applied_tick)}"
