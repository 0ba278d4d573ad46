"""The page on runs cannot rot: every measured number and every key of the export has its line."""

from __future__ import annotations

import re

import pytest

from parenting.server.db import Database
from parenting.server.export import rows
from parenting.server.new_run import NewRun, start
from parenting.server.queue.worker_side import watch
from parenting.server.reads.metrics import list_metrics
from parenting.server.runs import claim
from parenting.server.session import RunSession
from tests.tree import ROOT

GUIDE = (ROOT / "docs/runs.md").read_text(encoding="utf-8")


def names(section: str) -> list[str]:
    """The first cells of the table of a section."""
    text = GUIDE.partition(f"# {section}\n")[2].partition("\n#")[0]
    return re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)


@pytest.mark.slow
def test_numbers_and_keys_have_their_lines(db: Database) -> None:
    run = start(db, NewRun(world="unsafe-exploration", parent="scripted"))
    life = RunSession(db, claim(db, "test")[0], run, lambda: None)
    for _ in range(20):
        life.tick(watch(db, [run.id])[run.id])
    assert sorted(names("The numbers")) == sorted(list_metrics(db, run.id)[-1].values)
    assert names("The record, exported") == list(next(iter(rows(db, run.id))))
