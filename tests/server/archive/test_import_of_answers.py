"""Answers are imported in portions: one that corrects another finds it stored; a script keeps its name."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from sqlalchemy import select

from parenting.server import chain
from parenting.server.answer_tables import SCRIPT
from parenting.server.archive import import_answers
from parenting.server.archive.import_answers import portions
from parenting.server.archive.import_names import Naming
from parenting.server.archive.importing import import_export
from parenting.server.archive.target import target
from parenting.server.archive.writing import write_export
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import answer
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import claim
from parenting.server.tables import Answer
from tests.server.conftest import CLIPS


def corrected(*of: tuple[int, int, int | None]) -> list[list[int]]:
    """Return the numbers in each portion of answers: each a run, a number and what it supersedes."""
    rows = [(Naming(run, "", ""), SimpleNamespace(number=n, supersedes=s)) for run, n, s in of]
    return [[row.number for _, row in portion] for portion in portions(rows)]


def test_a_portion_ends_before_an_answer_that_corrects_one_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_answers, "AT_ONCE", 3)
    assert corrected() == []
    assert corrected(*((1, n, None) for n in range(1, 8))) == [[1, 2, 3], [4, 5, 6], [7]]
    assert corrected((1, 1, None), (1, 2, 1), (1, 3, 2), (1, 4, 1)) == [[1], [2], [3, 4]]
    assert corrected((1, 1, None), (2, 1, None), (2, 2, None), (1, 2, 1)) == [[1, 1, 2], [2]]
    assert corrected((1, 1, None), (2, 2, 1), (1, 1, None)) == [[1, 2, 1]], "it is of another run, or none"


def test_scripted_answers_and_corrections_are_those_of_the_export(
    db: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(import_answers, "AT_ONCE", 3)
    start(db, NewRun(world="unsafe-exploration", config={"pretrain": False}))
    (mine,) = claim(db, "test", -1)
    for place, (client, parent) in enumerate((("tab", "human"), (SCRIPT, "scripted")) * 2):
        query = post_query(db, mine, 2 * place + 1, "guidance", 1, CLIPS)
        answer(db, query, "left", client, parent)
        take_answer(db, mine, 2 * place + 2)
    for choice in ("right", "either"):
        supersede(db, query, choice, SCRIPT, "scripted")
    with target(tmp_path / "out.zip") as files:
        write_export(db, [1], files)
    import_export(db, tmp_path / "out.zip")
    with db.read() as session:
        names = (Answer.run_id, Answer.number, Answer.client_id, Answer.supersedes - Answer.id)
        found = session.execute(select(*names).order_by(Answer.run_id, Answer.number)).all()
    before, after = found[:6], found[6:]
    assert [(number, by == SCRIPT, back) for _, number, by, back in after] == [
        (number, by == SCRIPT, back) for _, number, by, back in before
    ]
    assert [back for *_, back in after] == [None] * 4 + [-1, -1]
    assert chain.check(db, 2).problems == []
