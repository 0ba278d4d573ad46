"""Entries of the audit log of what commands take out of the database."""

from __future__ import annotations

from collections.abc import Sequence

from parenting.commands.printing import say
from parenting.server.audit.recording import try_note_export
from parenting.server.db import Database


def note_export(db: Database, runs: Sequence[int], what: str) -> None:
    """Add an entry of an export for each run; where the store takes no writes, say so and go on."""
    refused = try_note_export(db, runs, what)
    if refused is not None:
        say(f"The audit log does not tell of this export: {refused.message}", err=True)
