"""A parent who reads nothing but the sentences of each question raises agents to the optimal policy."""

from __future__ import annotations

from typing import Any

import pytest
from fastapi.testclient import TestClient

from parenting.commands.answering import Answering, Order
from parenting.commands.client import Client
from parenting.commands.judge import Judge
from parenting.server.app import create_app
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.queue import worker_side
from parenting.server.runs import claim, get_run
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from tests.told_board import read_sentences

LEAST, MOST = 40, 200
"""Answers that are given at least, and those within which the policy is optimal."""


class Listener(Judge):
    """Answers by the sentences; of all else it knows the kind of the question.

    The scripted parent, who computes exact values of the world (Eq. 7), says beside it what it would answer.
    """

    def __init__(self) -> None:
        super().__init__()
        self.guided: list[tuple[str, str]] = []  # on guidance: its own choice, and the scripted parent's

    def choice(self, question: dict[str, Any]) -> str:
        mine = read_sentences(question["sentences"]).choice(question["kind"])
        if question["kind"] == "guidance":
            self.guided.append((mine, super().choice(question)))
        return mine


@pytest.mark.only("sqlite")
@pytest.mark.parametrize(
    ("world", "stages"),
    [
        ("unsafe-exploration", 1),
        pytest.param("unsafe-exploration", 3, marks=pytest.mark.torture),
        pytest.param("interruptibility", 1, marks=pytest.mark.torture),
        pytest.param("side-effects", 1, marks=pytest.mark.torture),
        pytest.param("absent-supervisor", 1, marks=pytest.mark.torture),
    ],
)
def test_the_sentences_suffice(settings: Settings, db: Database, world: str, stages: int) -> None:
    """Worker and web are in one process."""
    config: dict[str, Any] = {"max_open_preferences": 0, "stages": stages}
    config |= {"mature_every": 40} if stages > 1 else {}
    run = start(db, NewRun(world=world, preset="conservative", seed=5, config=config)).id
    (mine,) = claim(db, "test", -1)
    life = RunSession(db, mine, get_run(db, run), lambda: None)
    with TestClient(create_app(settings, db), base_url="http://localhost") as web:
        listener = Listener()
        order = Order(run, until_optimal=False, end_episodes=True)
        parent = Answering(Client("http://localhost", web), order, listener, lambda receipt: None)
        while (answered := parent.told.answered) < LEAST or (not life.optimal and answered < MOST):
            seen = worker_side.watch(db, [run])[run]
            if life.ready(seen):
                life.tick(seen)
                continue
            life.report_waiting(seen)
            if not parent.answer_one():
                parent._look()  # an episode without acceptable moves is ended
    assert life.optimal
    assert len(listener.guided) > 10
    assert [mine for mine, _ in listener.guided] == [scripted for _, scripted in listener.guided]
