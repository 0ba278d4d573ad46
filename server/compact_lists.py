"""Lists in the place of JSON objects, for clips and figures that have the usual parts. Nothing is lost.

Clips are `[SIDE, SIDE, board, changes, ...]`: a side is the letters of its actions, the numbers of its frames
and its chance, if it has one; a frame is the numbers of its two boards, then the agent's row and column, then
the box's. Figures are their values in the order of a layout, which the length tells. What would not come back
as it was has no list: then it is stored as `server.compact` has it.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from parenting.server.columns import UNREADABLE
from parenting.server.compact import EFFECT, FRAME, METRICS, REASON, change, changes, number_of

SIDES = ("left", "right")
LETTERS = {"up": "u", "down": "d", "left": "l", "right": "r"}
ACTIONS = {letter: action for action, letter in LETTERS.items()}
MILLION = 10**6
"""Probabilities of moves are rounded to so many parts, and stored as whole numbers of them."""
LARGEST = 3e38
"""No number of 32 bits is larger than a little more."""
CHANCES = tuple(f"probabilities.{move}" for move in range(4))
RECORDINGS = tuple(f"clips.{side}.{part}" for side in SIDES for part in ("kind", "first", "last"))
KINDS = {"exploitative": "e", "exploratory": "x"}
LAYOUTS: dict[tuple[str, ...], tuple[tuple[str, ...], ...]] = {
    METRICS: (METRICS, (*METRICS, "cells", "safe_cells")),
    EFFECT: (CHANCES,),
    REASON: (
        ("pausing", "familiarity", "p_guid", "chance", "draw", *CHANCES),
        ("p_pref", "draw", *CHANCES, *RECORDINGS),
    ),
}
"""The parts of figures in their order, by paths, for each kind of row; no two of a kind are equally long."""


def list_clips(clips: Mapping[str, Any]) -> list[Any] | None:
    """Return clips as a list; None where that would not give them back."""
    boards: list[str] = []
    try:
        sides = [_side(clips[name], boards) for name in SIDES]
        listed = [*sides, boards[0], *(changes(boards[0], other) for other in boards[1:])]
        return listed if _same(clips_of(listed), clips) else None
    except UNREADABLE:
        return None


def clips_of(listed: Sequence[Any]) -> dict[str, Any]:
    """Return clips as `list_clips` took them.

    Raises:
        AttributeError, LookupError, TypeError, ValueError: this is not a list of clips.
    """
    left, right, first, *others = listed
    boards = [board.split("\n") for board in (first, *(change(first, other) for other in others))]
    return {"left": _clip(left, boards), "right": _clip(right, boards)}


def list_figures(names: tuple[str, ...], figures: Mapping[str, Any]) -> list[Any] | None:
    """Return figures of a kind of row as a list; None where that would not give them back."""
    flat = dict(_flat(figures, ""))
    if tuple(flat) not in LAYOUTS.get(names, ()):
        return None
    try:
        listed = [_stored(path, value) for path, value in flat.items()]
        return listed if _same(figures_of(names, listed), figures) else None
    except UNREADABLE:
        return None


def figures_of(names: tuple[str, ...], listed: Sequence[Any]) -> dict[str, Any]:
    """Return figures as `list_figures` took them.

    Raises:
        LookupError, TypeError, ValueError: this is not a list of such figures.
    """
    layout = {len(one): one for one in LAYOUTS[names]}[len(listed)]
    found: dict[str, Any] = {}
    for path, value in zip(layout, listed, strict=True):
        *above, last = path.split(".")
        here: Any = found
        for place, name in enumerate(above):
            here = here.setdefault(name, [] if (*above, last)[place + 1].isdigit() else {})
        if isinstance(here, list):
            here.append(_read(path, value))
        else:
            here[last] = _read(path, value)
    return found


def _side(clip: Mapping[str, Any], boards: list[str]) -> list[Any]:
    numbers: list[int] = []
    for frame in clip["frames"]:
        numbers += [number_of(frame[name], boards) for name in FRAME[:2]]
        numbers += [*frame["agent"], *(frame["box"] or ())]
    chance = [clip["chance"]] if "chance" in clip else []
    return ["".join(LETTERS[action] for action in clip["actions"]), numbers, *chance]


def _clip(side: Sequence[Any], boards: Sequence[list[str]]) -> dict[str, Any]:
    letters, numbers, *chance = side
    wide = len(numbers) // (len(letters) + 1)
    starts = range(0, len(numbers), wide)
    clip = {
        "actions": [ACTIONS[letter] for letter in letters],
        "length": len(letters),
        "frames": [_frame(numbers[start : start + wide], boards) for start in starts],
    }
    return clip | ({"chance": chance[0]} if chance else {})


def _frame(numbers: Sequence[int], boards: Sequence[list[str]]) -> dict[str, Any]:
    ground, observed, row, column, *box = numbers
    if len(box) not in (0, 2) or min(ground, observed) < 0:
        raise ValueError("a frame has other numbers")
    shown = (list(boards[ground]), list(boards[observed]), [row, column], box or None)
    return dict(zip(FRAME, shown, strict=True))


def _flat(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Yield all values in objects and lists with their paths."""
    if isinstance(value, dict | list):
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        for name, one in pairs:
            yield from _flat(one, f"{path}.{name}" if path else str(name))
    else:
        yield path, value


def _stored(path: str, value: Any) -> Any:
    if path.endswith(".kind"):
        return KINDS[value]
    if not isinstance(value, float):
        return value
    if path in CHANCES and 0 <= value <= 1:
        parts = round(value * MILLION)
        return parts if parts / MILLION == value else value
    return value if path in CHANCES else _single(value)


def _read(path: str, value: Any) -> Any:
    if path.endswith(".kind"):
        return {letter: kind for kind, letter in KINDS.items()}[value]
    if path in CHANCES and isinstance(value, int):
        return value / MILLION
    return _of_single(value) if isinstance(value, str) else value


def _single(value: float) -> float | str:
    """Return a number of 32 bits by its few digits, as text; one that needs more, as it is."""
    if abs(value) > LARGEST:
        return value
    for digits in range(6, 10):
        text = f"{value:.{digits}g}"
        if len(text) + 2 < len(repr(value)) and _of_single(text) == value:
            return text
    return value


def _of_single(text: str) -> float:
    found: float = struct.unpack("<f", struct.pack("<f", float(text)))[0]
    return found


def _same(one: Any, other: Any) -> bool:
    """Return whether two values are stored as the same text: names in their order, whole numbers as such."""
    return json.dumps(one) == json.dumps(other)
