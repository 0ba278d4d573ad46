"""Measures of an answer in a sentence, for researchers alone, so in English."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

LAYOUTS = {"one": "one board", "two": "two boards", "turns": "clips in turn"}
INPUTS = {"key": "by key", "click": "by click", "touch": "by touch", "form": "by a form without script"}


def measures_text(measured: Mapping[str, Any], replays: int | None) -> str:
    """Return what was measured; what was not is left out.

    Args:
        measured: The measures (`server.measures.Measured`).
        replays: How often the clips were played again; None: not told.
    """
    get = measured.get
    away = get("away")
    parts = [
        _seconds("first reaction after {}", get("reacted")),
        _seconds("answered after {}", get("answered")),
        _seconds("sent {} later", get("queued")),
        "tab not left" if away == 0 else _seconds("tab left for {}", away),
        None if not replays else f"played again {replays} \u00d7",
        INPUTS.get(get("input") or ""),
        LAYOUTS.get(get("layout") or ""),
        {"right-left": "right candidate first"}.get(get("sides") or ""),
        None if None in (get("width"), get("height")) else f"{get('width')} \u00d7 {get('height')} px",
        None if get("wording") is None else f"wording {get('wording')}",
    ]
    return ", ".join(part for part in parts if part)


def _seconds(words: str, ms: int | None) -> str | None:
    return None if ms is None else words.format(f"{ms / 1000:.2f} s")
