"""A small fault, and the test that must catch it."""

from __future__ import annotations

from typing import NamedTuple


class Mutant(NamedTuple):
    """One fault: in `file` the `text` becomes `replacement`, and `test` has to fail."""

    name: str
    file: str
    text: str
    replacement: str
    test: str
