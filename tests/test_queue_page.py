"""docs/queue.md and its drawing hold every status, every state and every file of the queue."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest

from parenting.server.queue import answers, leases, worker_side
from parenting.server.queue.queries import withdraw_in
from parenting.server.statuses import JOB_STATES, QUERY_STATUSES, RUN_STATES, RUN_STATUSES, QueryStatus
from tests.tree import ROOT

PAGE = (ROOT / "docs/queue.md").read_text(encoding="utf-8")
DRAWING = ElementTree.parse(ROOT / "docs/pictures/queue.svg").getroot()


@pytest.mark.parametrize("sentences", [QUERY_STATUSES, RUN_STATUSES, RUN_STATES, JOB_STATES])
def test_statuses_stand_in_their_order_with_the_sentences_of_the_code(sentences: dict[str, str]) -> None:
    rows = re.findall(r"^\| \*(\w+)\* \| (.*) \|$", PAGE, re.M)
    found = [row for row in rows if row in [(str(word), text) for word, text in sentences.items()]]
    assert found == [(str(word), text) for word, text in sentences.items()]


def test_the_drawing_shows_every_status_of_a_query() -> None:
    texts = {text for element in DRAWING.iter() if (text := (element.text or "").strip())}
    assert set(map(str, QueryStatus)) <= texts


def test_the_drawing_names_verbs_that_exist() -> None:
    named = {
        name
        for element in DRAWING.iter()
        if element.get("class") == "verb"
        for name in (element.text or "").split(", ")
    }
    verbs = (worker_side.post_query, worker_side.take_answer, leases.lease, leases.release, answers.answer)
    assert named == {verb.__name__ for verb in (*verbs, withdraw_in)}


def test_every_file_of_the_queue_is_named() -> None:
    files = {file.name for file in (ROOT / "server/queue").glob("*.py")} - {"__init__.py"}
    assert files == set(re.findall(r"`(\w+\.py)`", PAGE.partition("## ")[0]))
