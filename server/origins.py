"""The parts of `Run.origin`: an earlier policy, earlier answers, and the run whose record was copied."""

from __future__ import annotations

from typing import Any

from parenting.server.columns import Damaged

ROLLED_BACK = "rolled_back"
"""The part that names the run whose record was copied, and the last tick of the copy."""
IMPORTED = "imported"
"""The part that names the run of another database that was imported, and the hash of its manifest."""


def rolled_back_to(origin: dict[str, Any] | Damaged | None) -> int:
    """Return the tick up to which a run's record was copied from another run; -1 if it was not."""
    if origin is None or isinstance(origin, Damaged) or ROLLED_BACK not in origin:
        return -1
    return int(origin[ROLLED_BACK]["tick"])


def stored_hashes(origin: dict[str, Any] | Damaged | None) -> set[str]:
    """Return the SHA-256 of the policy and of the answers that a run began with; none where it is damaged."""
    if origin is None or isinstance(origin, Damaged):
        return set()
    parts = (origin[name] for name in ("policy", "answers") if name in origin)
    return {str(part["stored"]) for part in parts}
