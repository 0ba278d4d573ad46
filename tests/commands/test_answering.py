"""A script before a run: stuck episodes are ended once each, and no lost reply makes it answer twice."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi.testclient import TestClient

from parenting.commands.answering import Answering, Order
from parenting.commands.client import Client, RefusedError
from parenting.commands.judge import Judge, Knowledge, shared_knowledge
from parenting.parents.fallible import FallibleRule
from parenting.parents.grammar import SCRIPTED, read_parent
from parenting.server import operator_events, runs
from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.identity import renew
from parenting.server.queue import answers
from parenting.server.queue.worker_side import watch
from parenting.server.reads.answers import every
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from tests.commands.asking import asked, begin
from tests.database import migrated
from tests.server.serving import free_port

Stored = Callable[[dict[str, Any]], object]


class Never(Judge):
    """A parent to whom no move is acceptable."""

    def choice(self, question: dict[str, Any], before: int = 0) -> str:
        return "neither" if question["kind"] == "guidance" else "either"


def script(
    web: httpx2.Client, judge: Judge, stored: Stored = lambda receipt: None, **order: Any
) -> Answering:
    """The command's own work, before run 1."""
    return Answering(Client("http://localhost", web), Order(1, **order), judge, stored)


@pytest.mark.slow
def test_episodes_are_ended_once_each(db: Database, web: httpx2.Client) -> None:
    run = begin(db)
    (mine,) = runs.claim(db, "test", -1)
    life = RunSession(db, mine, runs.get_run(db, run), lambda: None)
    work = script(web, Never(), end_episodes=True)
    stuck = 0
    while stuck < 3:
        seen = watch(db, [run])[run]
        if life.ready(seen):
            life.tick(seen)
        else:
            stuck += bool(life.saved.state.all_refused)
            life.report_waiting(seen)
            work.answer_one()
        assert work._look() is None
        assert work._look() is None
    assert work.told.episodes == len(operator_events.list_operator_events(db, run)) == 3
    assert work.told.choices["neither"] == work.told.answered


class Lossy(httpx2.Client):
    """Of three requests one never arrives; of three replies one is lost, though the server did as asked."""

    def __init__(self, web: httpx2.Client) -> None:
        super().__init__()
        self.web, self.rng = web, random.Random(3)

    def request(self, *arguments: Any, **more: Any) -> httpx2.Response:
        if self.rng.random() < 1 / 3:
            raise httpx2.ConnectError("refused")
        reply = self.web.request(*arguments, **more)
        if self.rng.random() < 1 / 3:
            raise httpx2.ReadError("cut off")
        return reply


def test_a_lost_reply_is_not_answered_twice(db: Database, web: httpx2.Client) -> None:
    run = begin(db)
    queries = asked(db, run, *range(1, 9), kind="preference")
    receipts: list[dict[str, Any]] = []
    assert script(Lossy(web), Never(), receipts.append, limit=8).work().kind == "limit"
    assert [row.answer.query_id for row in every(db, run)] == queries  # the oldest first, each once
    assert [receipt["number"] for receipt in receipts] == list(range(1, 9))


def test_what_somebody_else_has_answered_is_let_go(db: Database, web: httpx2.Client) -> None:
    run = begin(db)
    first, second = asked(db, run, 1, 2, kind="preference")

    class Slow(Never):
        def choice(self, question: dict[str, Any], before: int = 0) -> str:
            if question["id"] == first:
                answers.answer(db, first, "left", "somebody", "human")
            return super().choice(question)

    work = script(web, Slow(), limit=1)
    assert work.work().kind == "limit"
    assert (work.told.unneeded, work.told.answered) == (1, 1)
    assert [(row.answer.query_id, row.answer.client_id) for row in every(db, run)] == [
        (first, "somebody"),
        (second, "scripted"),
    ]


def test_an_answer_is_not_given_to_another_database_that_comes_to_the_address(
    db: Database, web: httpx2.Client, tmp_path: Path
) -> None:
    """It has a run and a question of the same numbers, and is served once the question was leased."""
    asked(db, begin(db), 1)
    settings = Settings(data=tmp_path / "other", database_url=None)
    other = migrated(settings)
    renew(other)
    asked(other, begin(other), 1)
    with TestClient(create_app(settings, other), base_url="http://localhost") as at_other:

        class Moves(Never):
            def choice(self, question: dict[str, Any], before: int = 0) -> str:
                work.client.http = at_other
                return super().choice(question)

        work = script(web, Moves())
        with pytest.raises(RefusedError, match="meant for another database") as refused:
            work.work()
    assert refused.value.status == 410
    assert list(every(db, 1)) == list(every(other, 1)) == []
    other.close()


def test_a_server_that_stays_away_is_given_up() -> None:
    with httpx2.Client() as nobody:
        work = Answering(
            Client(f"http://127.0.0.1:{free_port()}", nobody), Order(1, timeout=0.2), Never(), print
        )
        ending = work.work()
    assert ending.kind == "silent"
    assert ending.sentence.startswith("No server answers at http://127.0.0.1:")
    assert ending.sentence.endswith("Nothing was asked for 0.2 s.")


def leased(db: Database, web: httpx2.Client) -> dict[str, Any]:
    """The first question of a life, as a command has it."""
    begin(db)
    (mine,) = runs.claim(db, "test")
    life = RunSession(db, mine, runs.get_run(db, mine.run_id), lambda: None)
    while not (seen := watch(db, [mine.run_id])[mine.run_id]).open_guidance:
        life.tick(seen)
    reply = web.post(f"/api/v1/runs/{mine.run_id}/queries/lease", json={"client_id": "test"})
    question: dict[str, Any] = reply.json()
    return question


def test_parents_who_do_not_err_share_their_answers_and_others_do_not(
    db: Database, web: httpx2.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The second judge computes nothing; one who errs draws each answer."""
    judged = Counter[bool]()
    answer = FallibleRule.answer

    def counted(rule: FallibleRule, *said: Any) -> Any:
        judged[rule.spec.errs] += 1
        return answer(rule, *said)

    monkeypatch.setattr(FallibleRule, "answer", counted)
    shared_knowledge.cache_clear()
    question = leased(db, web)
    (choice,) = {Judge(seed=seed).choice(question) for seed in range(5)}
    assert judged == {False: 1}
    changed = question | {"left": question["right"], "right": question["left"]}
    swapped = {"left": "right", "right": "left"}
    assert Judge().choice(changed) == swapped.get(choice, choice)
    assert judged == {False: 2}
    noisy = Judge(read_parent("noisy:0.5"))
    assert len({noisy.choice(question | {"tick": tick}) for tick in range(20)}) > 1
    assert judged == {False: 2, True: 20}


def test_the_memory_of_answers_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.commands.judge.MOST_FOUND", 3)
    known = Knowledge("unsafe-exploration", None, 0.9, "up-down", SCRIPTED)
    for number in range(10):
        known.keep(bytes([number]), "left")
        assert bytes([number]) in known.found
        assert len(known.found) <= 3
