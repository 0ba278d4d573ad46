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
UPLOADED: dict[str, Any] = {
    "sha256": "5f2b" * 16,
    "file": "careful.safetensors",
    "world": WORLD,
    "levels": [f"world: {WORLD}\nname: island\n\n{OWN_LEVEL}\n"],
    "run": "3sQv8hYJ2cT7mWk9xRzLpB",
    "tick": 41,
}
SIZE = {"world": "interruptibility", "height": 7, "width": 8}
PRETRAINED = {"kind": "pretrain", "payload": SIZE}
