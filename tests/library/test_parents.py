"""Parents of one's own in `train`: ten lines, any number of trials, and a clear word for a wrong answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest
import torch

import parenting as pt
from parenting.agent.events import Event
from parenting.agent.query import silence

WORLD = "unsafe-exploration"


class StayDry(pt.Parent):
    def __init__(self) -> None:
        self.asked = list[tuple[int, str]]()

    def answer(self, question: pt.Question) -> str:
        self.asked.append((question.trial, question.kind))
        left, right = (clip.tiles[-1] == "W" for clip in (question.left, question.right))
        return {(0, 0): "either", (0, 1): "left", (1, 0): "right", (1, 1): "neither"}[left, right]


@pytest.mark.slow
def test_ones_own_parent_trains_agents_that_stay_dry() -> None:
    parent = StayDry()
    result = pt.train(WORLD, trials=3, parent=parent, until="queries:25", progress=False)
    assert [row["finished"] for row in result.trials] == [True] * 3
    assert sum(row["deaths"] for row in result.trials) == 0
    assert {trial for trial, _ in parent.asked} == {0, 1, 2}
    for trial in range(3):  # each question is asked once, and each answer arrives
        mine = sum(row["trial"] == trial for row in result.answers)
        assert mine == sum(of == trial for of, _ in parent.asked) == 25


def test_a_trial_that_is_done_asks_no_more() -> None:
    """Trials of one batch end at different ticks; a person must not answer for those that have ended."""
    parent = StayDry()
    result = pt.train(WORLD, trials=24, parent=parent, until="queries:5", progress=False)
    assert len({row["ticks"] for row in result.trials}) > 2  # else this test shows nothing
    assert len(parent.asked) == len(result.answers) == 24 * 5


class Scripted(pt.Parent):
    """The scripted parent's answers, one question at a time."""

    def begin(self, world: pt.World, config: pt.Config, trials: int) -> None:
        super().begin(world, config, trials)
        self.inner = pt.ScriptedParent()
        self.inner.begin(world, config, trials)

    def answer(self, question: pt.Question) -> pt.Choice:
        return self.inner.answer(question)


@pytest.mark.slow
def test_a_parent_who_answers_one_by_one_is_heard_as_one_who_answers_in_tensors() -> None:
    one_by_one = pt.train(WORLD, trials=5, seed=7, parent=Scripted(), progress=False)
    in_tensors = pt.train(WORLD, trials=5, seed=7, progress=False)
    assert one_by_one.trials == in_tensors.trials
    assert one_by_one.answers == in_tensors.answers


class NeverSure(pt.ScriptedParent):
    """The scripted parent, in tensors, whose answers are all *either*."""

    def take(self, state: pt.AgentState) -> pt.Answer:
        answer = super().take(state)
        said = (answer.choice > 0).long()
        return answer.replace(choice=said * int(pt.Choice.EITHER))


def test_a_subclass_of_the_scripted_parent_is_heard() -> None:
    result = pt.train(WORLD, trials=3, parent=NeverSure(), until="queries:5", progress=False)
    assert {row["choice"] for row in result.answers} == {"either"}
    assert len(result.answers) == 15


class Slow(StayDry):
    """Needs three looks at each question."""

    looks = 0

    def answer(self, question: pt.Question) -> str | None:  # type: ignore[override]
        self.looks += 1
        return super().answer(question) if self.looks % 3 == 0 else None


def test_a_parent_may_answer_later() -> None:
    result = pt.train(WORLD, parent=Slow(), until="queries:5", progress=False)
    assert result.answers[0]["answered"] - result.answers[0]["asked"] == 3
    assert len(result.answers) == 5


class Mute:
    """All that the protocol needs, and no more: an object that never answers."""

    def events(self, state: pt.AgentState) -> Sequence[Event]:
        return ()

    def take(self, state: pt.AgentState) -> pt.Answer:
        return silence(self.query if hasattr(self, "query") else blank(len(state.waiting)))

    def post(self, query: Any) -> None:
        self.query = query


def blank(trials: int) -> Any:
    from parenting.library.parent import nothing

    return nothing(pt.make(WORLD), pt.configure(WORLD), trials)


def test_any_object_with_the_three_verbs_is_a_parent() -> None:
    result = pt.train(WORLD, parent=Mute(), until="ticks:10", progress=False)
    assert result.answers == []
    assert result.trials[0]["ticks"] == 10


class OneForAll(Mute):
    """Answers for one trial, whatever their number is."""

    def take(self, state: pt.AgentState) -> pt.Answer:
        return silence(blank(1))


def test_answers_for_another_number_of_trials_are_refused() -> None:
    with pytest.raises(ValueError, match="take returned answers for 1 trials, and there are 2"):
        pt.train(WORLD, trials=2, parent=OneForAll(), progress=False)


class Wrong(pt.Parent):
    def answer(self, question: pt.Question) -> str:
        return "yes"


def test_a_wrong_answer_names_the_parent_and_what_may_be_said() -> None:
    with pytest.raises(ValueError, match=r"Wrong\.answer returned 'yes'\. Return 'left', 'right'"):
        pt.train(WORLD, parent=Wrong(), progress=False)


def test_a_parent_without_an_answer_cannot_be_made() -> None:
    with pytest.raises(TypeError, match="answer"):
        pt.Parent()  # type: ignore[abstract]


def test_a_replay_gives_the_same_agents(trained: pt.TrainResult) -> None:
    again = pt.train(WORLD, trials=3, seed=5, parent=pt.ReplayParent(trained), progress=False)
    assert again.trials == trained.trials
    assert again.answers == trained.answers
    assert all(
        torch.equal(one.parameters, other.parameters)
        for one, other in zip(again.policies, trained.policies, strict=True)
    )


def test_a_replay_refuses_other_agents(trained: pt.TrainResult) -> None:
    with pytest.raises(pt.ReplayError, match=r"At tick \d+ trial \d asks .* recorded is"):
        pt.train(WORLD, trials=3, seed=6, parent=pt.ReplayParent(trained.answers), progress=False)
