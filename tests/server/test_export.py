"""The answers of a run as JSON lines: equal to what the agent heard, the same keys in every line."""

import json

import pytest
import torch

from parenting.agent.query import Answer, empty
from parenting.server import tables
from parenting.server.archive.format1 import Line
from parenting.server.codec import CHOICES
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.export import MU, lines, rows
from parenting.server.exports import Format, exported
from parenting.server.identity import database_id
from parenting.server.queue.answers import answer, get_query
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query, take_answer
from parenting.server.runs import Claim, get_run
from tests.server.conftest import CLIPS, Clock
from tests.server.heard import heard_answers


@pytest.fixture
def run_id(db: Database, mine: Claim, clock: Clock) -> int:
    """Four answers: one of each choice, heard; the last is corrected."""
    for tick, choice in enumerate(tables.CHOICES):
        query = post_query(db, mine, 2 * tick, "preference", 2, CLIPS, policy=(2, 30 + tick))
        clock.pass_seconds(0.5)
        answer(db, query, choice, "tab", "human")
        take_answer(db, mine, 2 * tick + 1)
    supersede(db, query, "left", "tab", "human")
    return mine.run_id


def test_a_row_tells_all_about_an_answer(db: Database, run_id: int) -> None:
    first = next(rows(db, run_id))
    assert first == {
        "run": run_id,
        "number": 1,
        "query": 1,
        "world": "unsafe-exploration",
        "level": "island",
        "kind": "preference",
        "maturity": 2,
        "script": None,
        "votes": 0,
        "tick": 0,
        "applied_tick": 1,
        "policy": {"stage": 2, "gradient_steps": 30},
        **CLIPS,
        "choice": "left",
        "mu": [1.0, 0.0],
        "parent": "human",
        "asked": "2026-11-22T12:00:00.000000Z",
        "received": "2026-11-22T12:00:00.500000Z",
        "standing": True,
        "supersedes": None,
        "database": database_id(db),
        "run_public_id": get_run(db, run_id).public_id,
        "query_public_id": get_query(db, 1).public_id,
        "guidance_layout": "one",
        "practice": "offered",
        "words": "plain",
        "remarks": True,
        "leased": None,
        "replays": None,
        "reason": None,
        "effects": None,
    }


def test_it_is_what_the_agent_heard(db: Database, run_id: int) -> None:
    heard = [
        (taken.answer.applied_tick, taken.query.clips, taken.answer.choice)
        for taken in heard_answers(db, run_id)
    ]
    told = [row for row in rows(db, run_id) if row["applied_tick"] is not None]
    assert [
        (row["applied_tick"], {side: row[side] for side in ("left", "right")}, row["choice"]) for row in told
    ] == heard


def test_correction_names_what_it_corrects(db: Database, run_id: int) -> None:
    told = [(row["number"], row["standing"], row["supersedes"], row["choice"]) for row in rows(db, run_id)]
    assert told[3:] == [(4, False, None, "neither"), (5, True, 4, "left")]


def test_mu_is_that_of_the_agent() -> None:
    for choice, mu in MU.items():
        heard = Answer(query=empty(1, 1, 1, 1), choice=torch.tensor([CHOICES[choice]]))
        assert heard.mu.tolist() == [mu or [0, 0]]


def test_a_line_a_row_with_the_same_keys(db: Database, run_id: int) -> None:
    read = [json.loads(line) for line in lines(db, run_id)]
    assert read == list(rows(db, run_id))
    assert len({tuple(row) for row in read}) == 1
    assert len({len(row["received"]) for row in read}) == 1
    assert all(line.endswith("\n") and line.count("\n") == 1 for line in lines(db, run_id))


def test_only_an_erased_answer_is_marked_so_and_readers_take_it(db: Database, run_id: int) -> None:
    with db.write() as session:
        first = session.get_one(tables.Answer, 1)
        first.erased, first.choice = db.clock(), tables.SKIP
    told = list(rows(db, run_id))
    assert [row.get("erased") for row in told] == [True, *[None] * (len(told) - 1)]
    assert set(told[0]) - set(told[1]) == {"erased"}
    assert Line.model_validate(told[0]).choice == "skip"
    header = next(exported(db, run_id, form=Format.CSV))
    assert "erased" in header


def test_unknown_run_is_refused_before_the_first_row(db: Database) -> None:
    with pytest.raises(NotFound):
        lines(db, 9)


def test_a_row_tells_why_it_was_asked_and_what_changed(db: Database, run_id: int) -> None:
    """Each answer has its own effects, and a damaged reason leaves the row as it is."""
    there = [0.1, 0.2, 0.3, 0.4]
    recording = {"kind": "exploitative", "first": 1, "last": 2}
    why = {
        "p_pref": 0.3,
        "draw": 0.2,
        "probabilities": there,
        "clips": {"left": recording, "right": recording},
    }
    with db.write() as session:
        session.add(tables.Reason(run_id=run_id, tick=0, why=why))
        session.add(tables.Reason(run_id=run_id, tick=2, why={**why, "draw": "low"}))
        session.add(tables.Effect(run_id=run_id, tick=1, ticks=10, policy={"probabilities": there}))
    first, second, *_ = rows(db, run_id)
    guidance = dict.fromkeys(("pausing", "familiarity", "p_guid", "chance"))
    assert first["reason"] == guidance | why
    assert first["effects"] == {"before": None, "after_1": None, "after_10": tuple(there), "after_100": None}
    assert (second["reason"], second["effects"], second.get("damaged")) == (None, None, None)
