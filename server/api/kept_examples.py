"""Examples of the routes by which runs are kept in order and deleted."""

from __future__ import annotations

from typing import Any

HELD = {"answers": 51, "questions": 52, "checkpoints": 1, "metrics": 80, "events": 0, "bytes": 512_345}

AUDIT = {
    "id": 7,
    "kind": "operator",
    "what": "pause",
    "who": "session k3v9ab2c",
    "client": "192.0.2.7",
    "count": 1,
}
TABLE = {"text/csv": "run,number\r\n1,4\r\n"}


def kept(run: dict[str, Any]) -> dict[str, tuple[Any, ...]]:
    """Return the reply and the named requests of each operation, for an example of a run."""
    name, noon = run["public_id"], run["created"]
    tombstone = {
        "run": 1,
        "public_id": name,
        "created": noon,
        "deleted": noon,
        "gone": noon,
        "held": {"world": run["world"], "preset": "lax", "seed": 7, "parent": "human", "tick": 110, **HELD},
    }
    return {
        "describe_run": (run, {"name and tags": {"name": "first", "tags": ["pilot"]}}),
        "archive_run": ({**run, "archived": noon}, {"archive": {"archived": True}}),
        "see_holds": ({"run": 1, "public_id": name, **HELD},),
        "delete_run": (tombstone, {"this one": {"confirm": name}}),
        "read_audit_log": ({"rows": [{**AUDIT, "created": noon, "run": name}], "next": None},),
        "export_audit_log": (
            "id,created,kind,what,who,client,run,count\r\n"
            f"7,{noon},operator,pause,session k3v9ab2c,192.0.2.7,{name},1\r\n",
        ),
        "list_tombstones": ({"rows": [tombstone], "next": None},),
    }
