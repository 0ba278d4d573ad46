"""The heap of the web process: its threads share two of the C library's heaps.

Left to itself, the library gives threads up to eight heaps a core. What one thread freed there serves no
other, so each heap grows to the largest sum of replies that it ever held. Python's threads compute one at a
time, so that more heaps would not make them faster.
"""

from __future__ import annotations

import ctypes
import sys

ARENA_MAX = -8
"""The name of glibc's parameter in malloc.h."""
HEAPS = 2


def share_heaps() -> None:
    """Bound the heaps of this process; call it before threads are started."""
    if sys.platform == "linux" and (mallopt := getattr(ctypes.CDLL(None), "mallopt", None)):
        mallopt(ARENA_MAX, HEAPS)
