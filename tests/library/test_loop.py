"""`init`, `step` and `tick`: the loop by hand, in which nothing that was returned is written to."""

from __future__ import annotations

import pytest
import torch

import parenting as pt

WORLD = "unsafe-exploration"


def test_a_loop_by_hand_is_what_train_does(trained: pt.TrainResult) -> None:
    world, config = pt.make(WORLD), pt.configure(WORLD)
    state, parent = pt.init(world, config, seed=5), pt.ScriptedParent()
    for _ in range(trained.trials[0]["ticks"]):
        state, _, _, config = pt.tick(world, config, state, parent)
    assert torch.equal(state.learner.params[0], trained.policies[0].parameters)


def test_step_changes_nothing_that_it_was_given() -> None:
    """The engine works in place; the public step works on a copy."""
    world, config = pt.make(WORLD), pt.configure(WORLD)
    state, parent = pt.init(world, config, trials=2, seed=1), pt.ScriptedParent()
    for _ in range(40):
        before = {name: tensor.clone() for name, tensor in state.tensors().items()}
        after = pt.tick(world, config, state, parent).state
        now = state.tensors()
        assert [name for name, tensor in before.items() if not torch.equal(tensor, now[name])] == []
        state = after
    assert int(state.learner.steps[0]) > 0  # there was something to write


def test_what_was_returned_shares_no_memory_with_what_comes_next() -> None:
    world, config = pt.make(WORLD), pt.configure(WORLD)
    before = pt.init(world, config)
    after, _ = pt.step(world, config, before)
    places = {tensor.data_ptr() for tensor in before.learner.tensors().values() if tensor.numel()}
    assert not places & {tensor.data_ptr() for tensor in after.learner.tensors().values()}


def test_silence_is_the_answer_where_none_is_given() -> None:
    world, config = pt.make(WORLD), pt.configure(WORLD, p_guid=1.0)
    state = pt.init(world, config)
    for _ in range(5):
        state, _ = pt.step(world, config, state)
    assert bool(state.waiting[0])
    assert int(state.answered[0]) == 0


def test_the_config_of_a_loop_is_the_config_of_train(trained: pt.TrainResult) -> None:
    assert pt.configure(WORLD) == trained.config
    assert pt.configure(pt.make(WORLD, max_episode_steps=9)).max_episode_steps == 9


def test_states_and_queries_have_short_names() -> None:
    world = pt.make(WORLD)
    config = pt.configure(world, p_guid=1.0)
    state, query = pt.step(world, config, pt.init(world, config, trials=3))
    assert repr(state) == "<AgentState of 3 trials at tick 1>"
    assert repr(query) == "<Query of 3 trials: 3 guidance, 0 preference>"
    for part in (state.world, state.learner, state.recorder, query[0]):
        assert len(repr(part)) < 200


def test_a_query_gives_its_questions_as_plain_python() -> None:
    world = pt.make(WORLD)
    config = pt.configure(world, p_guid=1.0)
    _, query = pt.step(world, config, pt.init(world, config))
    (question,) = query
    assert question == query[0]
    start = world.levels[0].find("A")[0]
    for clip in (question.left, question.right):
        assert (len(clip.actions), len(clip.boards)) == (1, 2)
        assert clip.cells[0] == start
        assert clip.boards[0] == world.levels[0].rows
        y, x = clip.cells[-1]
        assert clip.boards[-1][y][x] == "A"
    with pytest.raises(IndexError, match="no trial 1"):
        query[1]
