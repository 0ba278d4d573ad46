"""Curves with fewer points: of each part the first, the least, the greatest and the last one.

A chart that is as many pixels wide as there are parts looks the same with them as with all points (the M4
aggregation of Jugel et al. 2014).
"""

from __future__ import annotations

from array import array

import numpy as np
from numpy.typing import NDArray

KEPT = 4
"""Points that a part keeps at most."""

Floats = NDArray[np.float64]


def thin(x: array[float], y: array[float], points: int) -> tuple[array[float], array[float]]:
    """Return at most `points` points of a curve, its extremes, begin and end among them.

    Args:
        x: Places, which never decrease.
        y: A value for each place.
        points: The most that may remain, at least four.
    """
    places, values = np.frombuffer(x), np.frombuffer(y)
    kept = _chosen(_parts(places, points // KEPT), values)
    return array("d", places[kept].tobytes()), array("d", values[kept].tobytes())


def _parts(places: Floats, number: int) -> NDArray[np.int64]:
    """Return the part in which each place lies, of so many parts of one width."""
    width = (places[-1] - places[0]) / number
    if not width:
        return np.zeros(len(places), np.int64)
    parts: NDArray[np.int64] = np.minimum((places - places[0]) / width, number - 1).astype(np.int64)
    return parts


def _chosen(parts: NDArray[np.int64], values: Floats) -> NDArray[np.int64]:
    """Return the indices of the points that stay."""
    begins = np.flatnonzero(np.diff(parts, prepend=-1))
    ends = np.append(begins[1:], len(parts)) - 1
    by_value = np.lexsort((values, parts))  # of each part, from the least value to the greatest
    return np.unique(np.concatenate((begins, ends, by_value[begins], by_value[ends])))
