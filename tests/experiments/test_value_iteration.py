"""Sec. 4.1's report by hand: which lives count, and seeds of any size."""

from __future__ import annotations

import json
import re

import pytest

from parenting.experiments.runner.store import Row
from parenting.experiments.spec import Request
from parenting.experiments.value_iteration import EXPERIMENT, tasks
from parenting.experiments.value_iteration.converge import CONFIG, STAGES
from parenting.experiments.value_iteration.report import finding
from parenting.experiments.value_iteration.settings import LEVELS, WORLD_SIZES
from parenting.experiments.value_iteration.tasks import mature_trials

KIND = WORLD_SIZES[0].world


def row(level: int, stage: int, before: int, after: int, converged: bool = True) -> Row:
    """A life with four states."""
    mine = {"of": KIND, "trial": 0, "level": level, "stage": stage, "states": 4, "converged": converged}
    return {**mine, "greedy_before": before, "greedy": after}


def test_a_life_that_went_astray_counts_no_more() -> None:
    """Sec. 4.1 supposes that every stage has converged: what stage 2 makes of a bad stage 1 says nothing."""
    rows = [row(0, 1, 1, 3, converged=False), row(0, 2, 1, 3), row(1, 1, 1, 4), row(1, 2, 2, 4)]
    first, second = (finding(KIND, [KIND], stage, rows) for stage in (1, 2))
    assert (first.ours, first.agrees) == (second.ours, second.agrees) == ("1 of 1", None)
    assert "1 did not converge" in second.note


def test_lives_that_were_greedy_before_are_counted_apart() -> None:
    rows = [row(0, 1, 1, 4), row(1, 1, 4, 4), row(2, 1, 4, 4)]
    found = finding(KIND, [KIND], 1, rows)
    assert (found.ours, found.agrees) == ("1 of 1", None)
    assert found.note.startswith("2 others were greedy from the beginning, and 2 of them")
    assert finding(KIND, [KIND], 1, rows[1:]).agrees is None, "nothing was taught"


@pytest.mark.parametrize(("agents", "agrees"), [(5, None), (73, True)])
def test_a_few_agents_prove_nothing(agents: int, agrees: bool | None) -> None:
    rows = [row(level, 1, 1, 4) for level in range(agents)]
    assert finding(KIND, [KIND], 1, rows).agrees is agrees


@pytest.mark.parametrize(("before", "ours"), [(1, "1 of 2"), (4, "1 of 1")])
def test_one_miss_is_a_miss(before: int, ours: str) -> None:
    """Of a life to teach as of one that was greedy before."""
    found = finding(KIND, [KIND], 1, [row(0, 1, 1, 4), row(1, 1, before, 3)])
    assert (found.ours, found.agrees) == (ours, False)


def test_the_page_has_the_config_the_lives_and_a_figure() -> None:
    request = Request(1)
    told = EXPERIMENT.report(request, [row(level, 1, 1, 4) for level in range(6)])
    assert re.findall(r"\d+", told.words[0]) == [str(STAGES), "6", "4", "4", "4"], "stages, agents, states"
    assert (
        json.loads(json.dumps(EXPERIMENT.config(request)))["agent"]["learning_rate"] == CONFIG.learning_rate
    )
    figure = pytest.importorskip("matplotlib.figure").Figure()
    told.figures["stages"](figure)
    drawn = [float(x) for line in figure.axes[0].lines if line.get_marker() == "o" for x in line.get_xdata()]
    assert drawn == [0, 100]


def test_every_seed_of_the_command_line_will_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """torch takes no seed beyond 2^63."""
    monkeypatch.setattr(tasks, "run_stage", lambda _world, _judge, state, _places: state)
    assert len(mature_trials(KIND, 0, 2**53 - 1)) == LEVELS * STAGES
