"""Parents who read nothing but words raise agents to the optimal policy.

One reads the sentences of a question, another the cells of its grid, both in Chromium's accessibility tree; a
third reads the sentences of the API. In the same life all of them give each time the answer of the scripted
parent, so each of them would raise the agent alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient
from playwright.sync_api import Browser, Page

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
from tests.lengths import length
from tests.pages.accessibility_tree import cells, sentences, tree
from tests.told_board import ToldBoard, read_sentences
from tests.told_grid import read_grid

LEAST, MOST = 40, 200
"""Answers that are given at least, and those within which the policy is optimal."""

OTHERS = (("unsafe-exploration", 3), ("interruptibility", 1), ("side-effects", 1), ("absent-supervisor", 1))
WORLDS = (("unsafe-exploration", 1), *length((), OTHERS))
"""World and stages of each life; only the first in a short run."""


class Listener(Judge):
    """Answers by words alone; of all else it knows the kind of the question.

    The scripted parent, who computes exact values of the world (Eq. 7), says beside it what it would answer.
    """

    def __init__(self, web: TestClient, page: Page) -> None:
        super().__init__()
        self.web, self.page = web, page
        self.session = page.context.new_cdp_session(page)
        self.answers: list[dict[str, str]] = []

    def choice(self, question: dict[str, Any], before: int = 0) -> str:
        told = {"api": read_sentences(question["sentences"]), **self._heard(question)}
        said = {name: board.choice(question["kind"]) for name, board in told.items()}
        if question["kind"] == "guidance":
            said["scripted"] = super().choice(question)
        self.answers.append(said)
        return said["cells"]

    def _heard(self, question: dict[str, Any]) -> dict[str, ToldBoard]:
        """Show the page and its grid as the server sends them, and read the tree."""
        path, query = f"/runs/{question['run_public_id']}/parent", {"query": question["public_id"]}
        grid = self.web.get(f"{path}/grid", params=query).raise_for_status().text
        text = self.web.get(path, params=query).raise_for_status().text
        self.page.set_content(text.replace("</main>", f"{grid}</main>"))
        self.page.evaluate("document.querySelector('.around').open = true")
        seen = tree(self.page, self.session)
        names = ("A", "B") if question["kind"] == "guidance" else ("Left", "Right")
        return {"sentences": read_sentences(sentences(seen), names), "cells": read_grid(cells(seen), names)}


@pytest.fixture
def screen(browser: Browser) -> Iterator[Page]:
    """A page without scripts."""
    context = browser.new_context(java_script_enabled=False)
    yield context.new_page()
    context.close()


@pytest.mark.slow
@pytest.mark.torture
@pytest.mark.parametrize(("world", "stages"), WORLDS)
def test_words_suffice(settings: Settings, db: Database, screen: Page, world: str, stages: int) -> None:
    """Worker and web are in one process. It takes long: one life, of which every question is shown."""
    config: dict[str, Any] = {"max_open_preferences": 0, "stages": stages}
    config |= {"mature_every": 40} if stages > 1 else {}
    run = start(db, NewRun(world=world, preset="conservative", seed=5, config=config)).id
    (mine,) = claim(db, "test", -1)
    life = RunSession(db, mine, get_run(db, run), lambda: None)
    with TestClient(create_app(settings, db), base_url="http://localhost") as web:
        listener = Listener(web, screen)
        order = Order(run, until_optimal=False, end_episodes=True)
        parent = Answering(Client("http://localhost", web), order, listener, lambda receipt: None)
        while (answered := parent.told.answered) < LEAST or (not life.optimality.found and answered < MOST):
            seen = worker_side.watch(db, [run])[run]
            if life.ready(seen):
                life.tick(seen)
                continue
            life.report_waiting(seen)
            if not parent.answer_one():
                parent._look()  # an episode without acceptable moves is ended
    assert life.optimality.found
    guided = [said for said in listener.answers if "scripted" in said]
    assert len(guided) > 10
    assert [said for said in listener.answers if len(set(said.values())) > 1] == []
