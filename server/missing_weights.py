"""The pre-trained weights that a new run lacks (Sec. 3.1.4)."""

from __future__ import annotations

from pathlib import Path

from parenting.envs import registry
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import PRETRAIN, NewRun, level_of, plan
from parenting.weights.store import Wanted


def missing_weights(new: NewRun, folder: Path | None, db: Database) -> Wanted | None:
    """Return the pre-trained weights without which a run cannot begin, if it could with them."""
    try:
        plan(new, folder, db=db)
    except InvalidFieldsError as error:
        level = level_of(new, [])
        if level is None or [field for field, _ in error.fields] != [PRETRAIN]:
            return None
        return Wanted(registry.spec(level.world, level), level.height, level.width)
    return None
