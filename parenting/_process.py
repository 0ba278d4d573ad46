"""A process that raises agents: one torch thread, and memory that is kept for the next step.

Two threads of torch are slower than one on networks of this size, so there is one process a core instead. A
step takes and frees the same tens of megabytes each time; left to itself, the C library hands them back to
the system and faults every page in again.
"""

from __future__ import annotations

import ctypes
import sys

import torch

TRIM_THRESHOLD, MMAP_MAX, ARENA_MAX = -1, -4, -8
"""The names of glibc's parameters in malloc.h."""
KEPT = 1 << 30
"""Bytes at the end of the heap that are not given back."""


def settle() -> None:
    """Make this process one that raises agents; call it before the first tensor."""
    torch.set_num_threads(1)
    if sys.platform == "linux" and (mallopt := getattr(ctypes.CDLL(None), "mallopt", None)):
        mallopt(ARENA_MAX, 1)  # threads share one heap: those of their own are small and given back
        mallopt(MMAP_MAX, 0)  # large blocks come from the heap, too,
        mallopt(TRIM_THRESHOLD, KEPT)  # and stay there
