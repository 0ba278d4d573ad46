"""Equal runs get equally many answers heard: no worker and no lease prefers one (docs/benchmarks.md)."""

from __future__ import annotations

import pytest

from benchmarks.waiting_runs import until_all_wait
from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import list_runs
from parenting.server.settings import Settings
from tests.faults.crowds import crowded, figures_of
from tests.faults.figures import Figures
from tests.lengths import length

pytestmark = [pytest.mark.torture, pytest.mark.timeout(length(300, 900))]
RUNS, WORKERS, SECONDS = length((16, 2, 8), (24, 3, 120))
MOST_TO_LEAST = length(2.0, 1.5)
CHANCE = length(4, 0)
"""So many answers more or less are chance where each run gets only five to ten of them in the short time.
A worker that prefers runs gives some a hundred times as many, but only seconds of a crowd show it."""


@pytest.mark.slow_on("postgresql")
def test_of_equal_runs_none_is_served_far_more_than_another(
    settings: Settings, db: Database, figures: Figures
) -> None:
    for seed in range(RUNS):
        start(db, NewRun(world="unsafe-exploration", seed=seed, config={"max_open_preferences": 0}))

    with crowded(settings, WORKERS) as house:
        until_all_wait(db, RUNS)  # those that are raised first would be ahead
        people = house.answer("--people", str(RUNS), "--think", "0", "--seconds", str(SECONDS))
        assert people.wait(SECONDS + 60) == 0, people.said()

    found = figures_of(people)
    figures.count("fairness", "answers", found["answered"])
    answers = sorted(run.standing for run in list_runs(db))
    assert answers[-1] <= MOST_TO_LEAST * answers[0] + CHANCE, answers
