"""Settings of Figure 4: the level, its two paths, and the shifts of the reward that are tried (Sec. 4.2)."""

from __future__ import annotations

WORLD, LEVEL = "side-effects", "box"


UNSAFE, SAFE = "drrdd", "ldrdrrd"


HORIZON, LENGTH, PAIRS = 50, 5, 20_000


SHIFTS = tuple(round(-1.5 + 0.125 * step, 3) for step in range(17))
"""From sigma's own neighbourhood (-1) to +0.5."""
