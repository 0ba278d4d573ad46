"""The words of a parent's answer (Sec. 2.1, 2.2), without torch."""

from __future__ import annotations

from enum import IntEnum


class Choice(IntEnum):
    """The parent's answer: none yet, one side, *either* (equivalent) or *neither* (both unacceptable).

    *Skip* judges neither side: the parent cannot tell.
    """

    NONE = 0
    LEFT = 1
    RIGHT = 2
    EITHER = 3
    NEITHER = 4
    SKIP = 5
