"""A house that is recorded: web, worker and parents until so many answers were told, then SIGKILL for all.

    python -m tests.faults.recorded_house DATA ANSWERS SYNCHRONOUS

The power-cut tests run it under strace. SYNCHRONOUS is *full*, as the product says, or a weaker level that
every process of the house is given instead.
"""

from __future__ import annotations

import os
import random
import sys
from functools import partial
from pathlib import Path
from typing import Any

import torch
from pysqlite3 import dbapi2 as sqlite

from parenting.server.settings import Settings
from tests import access
from tests.faults.house import House

PARENTS = 3


def weaken(level: str) -> None:
    """Let every connection of this process have that `synchronous`, whatever the product asks for."""
    connect = sqlite.connect

    class Cursor(sqlite.Cursor):  # type: ignore[misc]  # pysqlite3 carries no types
        def execute(self, statement: str, *rest: Any) -> Any:
            weak = statement.startswith("PRAGMA synchronous")
            return super().execute(f"PRAGMA synchronous={level}" if weak else statement, *rest)

    class Connection(sqlite.Connection):  # type: ignore[misc]  # pysqlite3 carries no types
        def cursor(self, factory: Any = Cursor) -> Any:
            return super().cursor(factory)

        def execute(self, statement: str, *rest: Any) -> Any:
            return self.cursor().execute(statement, *rest)

    sqlite.connect = partial(connect, factory=Connection)


class Weakened(House):
    """A house whose processes sync less than the product says."""

    def __init__(self, settings: Settings, level: str) -> None:
        super().__init__(settings)
        self.patches = {}
        if level != "full":
            self.prepare = partial(weaken, level)


def main(data: Path, answers: int, level: str) -> None:
    """Live until so many answers were told."""
    torch.set_num_threads(1)
    access.use()  # pytest has not loaded its settings here
    with Weakened(Settings(data=data, database_url=None), level) as house:
        runs = [row["id"] for row in house.store.rows("SELECT id FROM run")]
        house.keep()
        house.move_in(runs, PARENTS, random.Random(str(data)))
        house.until_told(answers)
        for one in house.commands.values():
            one.kill()
    os._exit(0)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3])
