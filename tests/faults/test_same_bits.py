"""`parenting answer` trains an agent to the same bits as the scripted parent, at T = 1 and on PostgreSQL.

tests/server/test_same_bits.py does the same on SQLite, in stages up to T = 2.
"""

from __future__ import annotations

import pytest

from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.server.test_same_bits import raise_through_http

PLACES = [("sqlite", 1), ("postgresql", 1), ("postgresql", 2)]
"""Stores with numbers of stages. How stores differ is the same in each stage, so that one is enough."""


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(("store", "stages"), PLACES, indirect=["store"])
def test_raised_through_http(settings: Settings, db: Database, stages: int) -> None:
    raise_through_http(settings, db, stages)
