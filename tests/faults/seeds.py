"""One seed for a whole run of the fault tests. It is printed, and a run with the same one draws the same."""

from __future__ import annotations

import os
import random
import secrets

VARIABLE = "PARENTING_FAULTS_SEED"


def settle() -> str:
    """The seed of this run, drawn unless the environment names one; the processes of xdist inherit it."""
    return os.environ.setdefault(VARIABLE, str(secrets.randbelow(10**9)))


def draws(name: str) -> random.Random:
    """The random numbers of one test."""
    return random.Random(f"{settle()} {name}")
