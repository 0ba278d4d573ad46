"""Boards as text or as pixels, for Gymnasium."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from parenting.envs.art import draw
from parenting.envs.levels.spec import WorldSpec

Frame = str | NDArray[np.uint8]

MODES = ("ansi", "rgb_array")
"""The modes in which a board is drawn."""

CELL = 16
"""Pixels along the side of a cell in the mode `rgb_array`."""

PALETTE = {
    "wall": (110, 110, 110),
    "land": (240, 240, 235),
    "water": (0, 114, 178),
    "goal": (0, 158, 115),
    "agent": (213, 94, 0),
    "box": (230, 159, 0),
    "interruption": (204, 121, 167),
    "button": (120, 70, 150),
    "watered plant": (90, 140, 30),
    "dry plant": (170, 130, 80),
    "bucket": (86, 180, 233),
    "shortcut": (240, 228, 66),
    "supervisor": (60, 50, 80),
}
"""The colour of each tile by its name in the legends, after Okabe and Ito; a world may bring its own."""


def check_mode(mode: str | None) -> str | None:
    """Return the render mode.

    Raises:
        ValueError: it is not ansi, rgb_array or None.
    """
    if mode not in (None, *MODES):
        raise ValueError(f"render_mode must be ansi, rgb_array or None, not {mode!r}.")
    return mode


class Painter:
    """Draws the boards of a world."""

    def __init__(self, spec: WorldSpec) -> None:
        """Prepare the colour of each code."""
        palette = {**PALETTE, **spec.colours}
        self._glyphs = spec.glyphs
        self._colours = np.array([palette[tile] for tile in spec.legend.values()], dtype=np.uint8)

    def frame(self, codes: NDArray[np.uint8], mode: str) -> Frame:
        """Draw a board of codes [H, W]: lines of glyphs (`ansi`), or pixels (`rgb_array`)."""
        if mode == "ansi":
            rows: Sequence[Sequence[int]] = codes.tolist()
            return "\n".join(draw(rows, self._glyphs))
        return self._colours[codes].repeat(CELL, axis=0).repeat(CELL, axis=1)
