"""Examples of the routes on levels of one's own and their weights."""

from __future__ import annotations

from typing import Any

from parenting.server.level_check import check, import_levels

WORLD = "unsafe-exploration"
OWN_LEVEL = "WWWWW\nWA GW\nWWWWW"
TO_CHECK = {"world": WORLD, "text": OWN_LEVEL.replace("G", " ")}
CHECKED: dict[str, Any] = check(**TO_CHECK).model_dump()
LAKE = {"text": "SFF\nFHF\nFFG\n"}
IMPORTED: dict[str, Any] = import_levels(**LAKE).model_dump()
SIZE = {"world": "interruptibility", "height": 7, "width": 8}
PRETRAINED = {"kind": "pretrain", "payload": SIZE}
