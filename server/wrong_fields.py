"""Pydantic's errors as fields and sentences for people."""

from __future__ import annotations

from typing import Any

from parenting.server.patterns import WRITE

UNREAD = {
    "json_invalid": "This is not JSON.",
    "union_tag_invalid": "It is of none of the kinds that there are.",
    "union_tag_not_found": "Name its kind.",
    "model_attributes_type": "Send a JSON object, with the header Content-Type: application/json.",
}
"""The message for a body that cannot be read, by Pydantic's type of error."""


def messages(errors: Any, skip: tuple[str, ...] = ()) -> list[tuple[str, str]]:
    """Pydantic's errors as (field, message), without what was sent: nothing of a request is echoed."""
    found: dict[str, str] = {}
    for error in errors:
        path = [str(part) for part in error["loc"] if part not in skip and error["type"] != "json_invalid"]
        if path[:1] == ["config"]:
            path = path[:2]  # the rest names the branch of the union that was tried
        message = UNREAD.get(error["type"]) or WRITE.get(error.get("ctx", {}).get("pattern", ""))
        message = message or error["msg"].removeprefix("Value error, ")
        found.setdefault(".".join(path) or "body", message)
    return list(found.items())
