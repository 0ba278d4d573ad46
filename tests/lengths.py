"""Short tests for every change and long ones for the night: `make torture` sets PARENTING_TORTURE.

A test of two lengths asserts the same in both; it bears the mark `torture`, by which the target finds it.
"""

import os
from typing import TypeVar

TORTURE = os.environ.get("PARENTING_TORTURE") == "1"
T = TypeVar("T")


def length(short: T, long: T) -> T:
    """The long one in `make torture`, else the short one."""
    return long if TORTURE else short
