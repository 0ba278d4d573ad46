"""The bytes of a snapshot: a column for each number of a state. Torch-free.

Integers are little-endian; probabilities are in 255ths. Four zeros are a policy that is not known.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping

COLUMNS = {"policy": 4, "familiarity": 2, "visits": 4, "deaths": 4, "entries": 4}
"""The bytes of a state in each column, in the order in which they are stored."""
SHARE = 255
"""A probability of 1."""


def pack(columns: Mapping[str, bytes]) -> bytes:
    """Return columns as one compressed text; of an earlier stage's policy there is no other column."""
    return zlib.compress(b"".join(columns.get(name, b"") for name in COLUMNS), 6)


def unpack(blob: bytes, states: int) -> dict[str, bytes]:
    """Return the columns of a snapshot; those that are not stored are missing.

    Raises:
        ValueError: the bytes are not those of a snapshot of so many states.
    """
    try:
        whole = zlib.decompress(blob)
    except zlib.error as error:
        raise ValueError("its content cannot be decompressed") from error
    found, begin = {}, 0
    for name, width in COLUMNS.items():
        if begin < len(whole):
            found[name] = whole[begin : begin + width * states]
            begin += width * states
    if begin != len(whole):
        raise ValueError("it is not the size of its states")
    return found


def known_policies(policy: bytes) -> int:
    """Return in how many states a column has the policy."""
    return sum(map(bool, memoryview(policy).cast("I")))


def text_of(column: bytes) -> str:
    """Return a column as base64."""
    return base64.b64encode(column).decode()
