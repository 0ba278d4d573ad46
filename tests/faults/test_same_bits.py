"""`parenting answer` trains an agent on PostgreSQL to the same bits as the scripted parent in tensors.

tests/server/test_same_bits.py does the same on SQLite.
"""

from __future__ import annotations

import pytest

from parenting.server.db import Database
from parenting.server.settings import Settings
from tests.lengths import length
from tests.server.test_same_bits import raise_through_http


@pytest.mark.torture
@pytest.mark.timeout(300)
@pytest.mark.only("postgresql", "tests/server/test_same_bits.py does the same on SQLite")
@pytest.mark.parametrize("stages", length([2], [1, 2]))
def test_raised_through_http(settings: Settings, db: Database, stages: int) -> None:
    """How the stores differ is the same in each stage, so that one is enough."""
    raise_through_http(settings, db, stages)
