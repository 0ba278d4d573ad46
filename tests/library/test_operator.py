"""A parent of one's own that acts as the operator: its events apply, are logged, stored and replayed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

import parenting as pt
from parenting.agent.events import Change, Event, Mature

WORLD = "unsafe-exploration"


class Operator(pt.Parent):
    """Ends the first stage before tick 5, and asks less from tick 8 on."""

    def answer(self, question: pt.Question) -> str:
        left, right = (clip.tiles[-1] == "W" for clip in (question.left, question.right))
        return {(0, 0): "either", (0, 1): "left", (1, 0): "right", (1, 1): "neither"}[left, right]

    def events(self, state: pt.AgentState) -> Sequence[Event]:
        tick = int(state.keys.tick[0]) + 1
        acts: dict[int, list[Event]] = {5: [Mature()], 8: [Change(name="p_guid", value=0.25)]}
        return acts.get(tick, [])


@pytest.mark.slow
def test_a_parent_may_act_as_the_operator_and_a_replay_does_the_same(tmp_path: Path) -> None:
    arguments: dict[str, Any] = {"trials": 2, "until": "ticks:30", "max_clip_length": 2, "progress": False}
    result = pt.train(WORLD, parent=Operator(), **arguments)
    assert [row["stage"] for row in result.trials] == [2, 2]
    assert result.events == [
        {"tick": 5, "kind": "mature", "name": None, "value": None},
        {"tick": 8, "kind": "change", "name": "p_guid", "value": 0.25},
    ]
    stored = pt.load_result(result.save(tmp_path / "result"))
    assert stored.events == result.events
    again = pt.train(WORLD, parent=pt.ReplayParent(stored), **arguments)
    assert (again.trials, again.answers, again.events) == (result.trials, result.answers, result.events)
