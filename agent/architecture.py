"""The layers of the policy by their sizes (Sec. 3.1.1), for those who need no weights. No torch here."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

HIDDEN = 64
FILTERS = (16, 32, 64, 64)
ACTIONS = 4


class Padding(NamedTuple):
    """A convolution's padding before and after one axis, in cells, and the length of its output."""

    before: int
    after: int
    length: int


def padding(length: int) -> Padding:
    """Longer than 3 shrinks by 2; 3 shrinks to 2 (one cell behind); 2 or less keeps its size (ours)."""
    if length > 3:
        return Padding(0, 0, length - 2)
    return Padding(0, 1, 2) if length == 3 else Padding(1, 1, length)


def weights_of(height: int, width: int, codes: int) -> int:
    """Return how many weights and biases the policy has, for boards of a size with some kinds of things."""
    return sum((fan_in + 1) * fan_out for fan_in, fan_out in _layers(height, width, codes))


def _layers(height: int, width: int, codes: int) -> Iterator[tuple[int, int]]:
    yield ACTIONS * codes, HIDDEN
    yield HIDDEN, ACTIONS
    channels = codes
    for filters in FILTERS:
        if height <= 2 and width <= 2:
            break
        yield 9 * channels, filters
        height, width, channels = padding(height).length, padding(width).length, filters
    yield height * width * channels, HIDDEN
    yield HIDDEN, ACTIONS
