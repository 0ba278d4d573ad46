"""A loop of one's own: what does not belong together is refused before the engine reads it."""

from __future__ import annotations

from typing import Any

import pytest
import torch

import parenting as pt

WORLD = "unsafe-exploration"


@pytest.fixture(scope="module")
def asked() -> tuple[pt.World, pt.Config, pt.AgentState, Any]:
    world, config = pt.make(WORLD), pt.configure(WORLD, p_guid=1.0)
    return world, config, *pt.step(world, config, pt.init(world, config, trials=2))


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ([1], ["shape (1,)", "2 agents"]),
        ([1, 6], ["[1, 6]", "4 neither", "5 skip"]),
        ([-1, 0], ["[-1, 0]", "0 none"]),
        ([1.0, 2.0], ["[1.0, 2.0]", "whole numbers"]),
    ],
)
def test_a_choice_that_cannot_be_is_refused(
    asked: tuple[pt.World, pt.Config, pt.AgentState, Any], choice: list[float], words: list[str]
) -> None:
    world, config, state, query = asked
    with pytest.raises(ValueError, match="answer: choice") as found:
        pt.step(world, config, state, pt.Answer(query=query, choice=torch.tensor(choice)))
    assert [word for word in words if word not in str(found.value)] == []


@pytest.mark.parametrize("wrong", [[pt.Choice.LEFT, pt.Choice.LEFT], "left", 1])
def test_what_is_not_an_answer_is_told_how_to_be_one(
    asked: tuple[pt.World, pt.Config, pt.AgentState, Any], wrong: Any
) -> None:
    world, config, state, _ = asked
    with pytest.raises(TypeError, match=r"answer: .* is not an Answer. Give pt.Answer\(query=query, choice="):
        pt.step(world, config, state, wrong)


def test_a_state_of_another_world_or_config_is_refused(
    asked: tuple[pt.World, pt.Config, pt.AgentState, Any],
) -> None:
    _, config, state, _ = asked
    with pytest.raises(ValueError, match=r"state: .*6 x 8 .* and this is side-effects"):
        pt.step(pt.make("side-effects"), config, state)
    with pytest.raises(ValueError, match="config: max_clip_length is 3, and this state was made for 1"):
        pt.step(pt.make(WORLD), pt.configure(WORLD, max_clip_length=3), state)


def test_other_types_are_named_with_what_makes_the_right_one(
    asked: tuple[pt.World, pt.Config, pt.AgentState, Any],
) -> None:
    world, config, state, _ = asked
    wrong: list[tuple[tuple[Any, ...], str]] = [
        ((WORLD, config, state), "pt.make"),
        ((world, "lax", state), "pt.configure"),
        ((world, config, None), "pt.init"),
    ]
    for arguments, remedy in wrong:
        with pytest.raises(TypeError, match=remedy):
            pt.step(*arguments)
    for config_of_init in (3, "lax"):
        with pytest.raises(TypeError, match=r"config: .* is not a Config.*pt.configure"):
            pt.init(world, config_of_init)  # type: ignore[arg-type]
    others: list[tuple[Any, str]] = [
        ("scripted", "'scripted' is not a parent.*pt.ScriptedParent"),
        (pt.ScriptedParent, r"is a class.*Call it: parent=pt.ScriptedParent\(\)"),
        (type("Slow", (pt.ScriptedParent,), {}), r"is a class.*Call it: parent=Slow\(\)"),
    ]
    for parent, remedy in others:
        with pytest.raises(ValueError, match=remedy):
            pt.tick(world, config, state, parent)


def test_init_takes_a_world_by_its_name() -> None:
    config = pt.configure("side-effects")
    by_name, by_world = (pt.init(one, config, seed=4) for one in ("side-effects", pt.make("side-effects")))
    assert torch.equal(by_name.learner.params, by_world.learner.params)
    pt.step(pt.make("side-effects"), config, by_name)
