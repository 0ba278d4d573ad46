"""The growth of an agent: milestones at their ticks, the lesson of an answer, cells that are safe by now."""

from __future__ import annotations

import pytest
import torch

from parenting.agent.init import network_of
from parenting.agent.query import Answer, Choice, empty
from parenting.agent.state import AgentState
from parenting.envs.gridworld import local_state
from parenting.server import metrics
from parenting.server.db import Database
from parenting.server.lesson import Lesson
from parenting.server.milestones import CALM, CALM_TICKS, GOAL
from parenting.server.new_run import NewRun, start
from parenting.server.progress import report_progress
from parenting.server.queue import worker_side
from parenting.server.queue.answers import answer
from parenting.server.reads.growth import MILESTONES, growth_of, lesson_of, milestones_of
from parenting.server.reads.metrics import list_metrics
from parenting.server.runs import Claim, claim, get_run
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.worker import Worker
from tests.server.raising import ISLAND, Inline

pytestmark = pytest.mark.only("sqlite", "what is told depends on no store")


def on_goal(state: AgentState, inline: Inline) -> bool:
    here = state.world
    goal = inline.world.tile(here.board, here.agent) == inline.world.code("G")
    return bool((here.terminated & goal)[0])


def milestones_by_hand(ticks: int) -> dict[str, int]:
    """The first tick at the goal, and the first after a hundred without an unsafe move."""
    inline, found, unsafe_at, deaths = Inline(), dict[str, int](), 0, 0
    for tick in range(1, ticks + 1):
        inline.tick()
        if int(inline.saved.tally.deaths[0]) > deaths:
            unsafe_at, deaths = tick, int(inline.saved.tally.deaths[0])
        if on_goal(inline.saved.state, inline):
            found.setdefault(GOAL, tick)
        if tick - unsafe_at >= CALM_TICKS:
            found.setdefault(CALM, tick)
    return found


@pytest.mark.slow
def test_milestones_stand_at_the_ticks_at_which_they_happened(db: Database, settings: Settings) -> None:
    run = start(db, ISLAND.new("scripted")).id
    worker = Worker(db, settings)
    worker._claim()
    while run in worker.claims:
        worker._round()
    told = get_run(db, run)
    assert told.status == "finished"
    expected = milestones_by_hand(told.tick)
    assert GOAL in expected
    assert told.milestones == expected
    rows = [row.values for row in list_metrics(db, run)]
    assert rows[-1]["safe_cells"] > 0
    assert {row["cells"] for row in rows} == {rows[0]["cells"]}
    worker._close()


def test_a_lesson_is_the_policy_in_the_asked_cell_before_the_answer_and_now(db: Database) -> None:
    run = start(db, NewRun(world="unsafe-exploration", parent="human", seed=4)).id
    (mine,) = claim(db, "worker")
    life = RunSession(db, mine, get_run(db, run), lambda: None)
    assert get_run(db, run).lesson is None
    for choice in ("left", "neither", "right"):
        while not (seen := worker_side.watch(db, [run])[run]).open_guidance:
            life.tick(seen)
        state = life.saved.state
        here = state.world
        sight = life.world.observe(here.board, here.agent, here.box)
        network, near = network_of(life.world), local_state(sight, here.agent)
        before = network.logits(state.learner.params, sight, near)[0].softmax(-1).tolist()
        asked = worker_side.asked_at(db, run, life.last_tick)
        assert asked is not None
        answer(db, asked.id, choice, "me", "human")
        life._measured_at = -1e9
        life.tick(worker_side.watch(db, [run])[run])
        after = network.logits(life.saved.state.learner.params, sight, near)[0].softmax(-1).tolist()
        life._news = True
        life._measured_at = -1e9
        life._measure(at_once=False)
        lesson = get_run(db, run).lesson or {}
        assert (lesson["kind"], lesson["tick"]) == ("guidance", life.last_tick)
        assert lesson["cell"] == here.agent[0].tolist()
        assert lesson["before"] == pytest.approx(before, abs=2e-6)
        assert lesson["after"] == pytest.approx(after, abs=2e-6)
        assert (lesson["before"] != lesson["after"]) == (choice != "neither")


def test_silence_and_a_skip_have_no_lesson() -> None:
    inline = Inline()
    lesson = Lesson(inline.world)
    query = empty(1, 1, inline.world.height, inline.world.width)
    for choice in (Choice.NONE, Choice.SKIP):
        lesson.hear(inline.saved.state, Answer(query=query, choice=torch.tensor([int(choice)])))
        assert lesson.news(inline.saved.state) is None


def test_growth_is_by_answers_and_rows_of_older_versions_have_no_point(db: Database, mine: Claim) -> None:
    run = get_run(db, mine.run_id)
    old = {"guidance": 1, "preference": 0, "return": 0.5, "optimal_return": 1.0}
    metrics.write_metrics(db, mine, {1: old})
    assert growth_of(db, run) is None
    rows = {2: {**old, "guidance": 3, "cells": 8, "safe_cells": 2}}
    rows[9] = {**old, "guidance": 5, "preference": 1, "cells": 8, "safe_cells": 6}
    metrics.write_metrics(db, mine, rows)
    found = growth_of(db, run)
    assert found is not None
    assert (found.answers, found.spoken) == (
        6,
        "After 6 answers it reaches the goal safely from 75\xa0% of 8 cells.",
    )
    garden = start(db, NewRun(world="reward-hacking"))
    other = next(one for one in claim(db, "worker-2") if one.run_id == garden.id)
    metrics.write_metrics(db, other, {1: {**old, "return": 5.0, "optimal_return": 20.0}})
    found = growth_of(db, garden)
    assert found is not None
    assert found.spoken == "After 1 answer it earns 25\xa0% of what could be expected."


def test_milestones_and_lessons_are_told_in_sentences(db: Database, mine: Claim) -> None:
    assert list(MILESTONES) == [GOAL, CALM]
    assert f"in {CALM_TICKS} ticks" in MILESTONES[CALM]
    assert (milestones_of(get_run(db, mine.run_id)), lesson_of(get_run(db, mine.run_id))) == ({}, None)
    lesson = {"tick": 3, "kind": "guidance", "cell": [1, 1], "before": [0.25] * 4}
    lesson |= {"after": [0.248, 0.25, 0.25, 0.252]}
    report_progress(db, mine, milestones={CALM: 180, GOAL: 300}, lesson=lesson)
    run = get_run(db, mine.run_id)
    assert list(milestones_of(run)) == [CALM, GOAL]
    assert (
        lesson_of(run) == "The last answer has hardly changed what it would do in the cell of the question."
    )
