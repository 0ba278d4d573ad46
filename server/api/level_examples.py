"""Examples of the routes on levels of one's own and their weights."""

from __future__ import annotations

from typing import Any

from parenting.server.level_check import check

WORLD = "unsafe-exploration"
OWN_LEVEL = "WWWWW\nWA GW\nWWWWW"
TO_CHECK = {"world": WORLD, "text": OWN_LEVEL.replace("G", " ")}
CHECKED: dict[str, Any] = check(**TO_CHECK).model_dump()
SIZE = {"world": "interruptibility", "height": 7, "width": 8}
PRETRAINED = {"kind": "pretrain", "payload": SIZE}
