"""Mutants: small faults in what matters most, each with the test that must catch it.

`make mutants` tries them. A mutant replaces a text that stands once in a file. The tests named are about what
the mutant breaks, so that a fault is told by the test that a reader would look at.
"""

from __future__ import annotations

from tests.mutants.asking import ANSWERING, ASKING, MATURING
from tests.mutants.learning import LEARNING, SAMPLING
from tests.mutants.mutant import Mutant
from tests.mutants.server import QUEUE, WEB
from tests.mutants.worlds import RANDOM

__all__ = ["MUTANTS", "Mutant"]

MUTANTS = [*RANDOM, *SAMPLING, *LEARNING, *ASKING, *MATURING, *ANSWERING, *QUEUE, *WEB]
