"""Arguments of a wrong type: the argument, its value and the remedy, and no error from within."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import parenting as pt

WORLD = "unsafe-exploration"
A: Any = pt  # calls that a type checker refuses, too

CALLS: list[tuple[Any, str]] = [
    (lambda: A.train(WORLD, parent=pt.ScriptedParent), r"parent: ScriptedParent is a class.*Call it"),
    (lambda: A.train(WORLD, level=3), "level: 3 is not a level"),
    (lambda: A.train(WORLD, callback=3), "callback: 3 is not a function"),
    (lambda: A.train(WORLD, progress="x"), "progress: 'x' is not True, False or None"),
    (lambda: A.ReplayParent(3), "recorded: 3 is neither.*pt.load_result"),
    (lambda: A.ReplayParent("res"), "recorded: 'res' is neither.*pt.load_result"),
    (lambda: A.ReplayParent([{"trial": 1}]), "recorded: .*'trial': 1.* is neither"),
    (lambda: A.register(3), "spec: 3 is not a WorldSpec"),
    (lambda: A.load_policy(None), "path: None is not the path"),
    (lambda: A.load_result(3), "folder: 3 is not the path"),
    (lambda: A.evaluate("file"), r"policy: 'file' is not a policy; use pt.load_policy\(file\)"),
    (lambda: A.evaluate(lambda _: 0), r"policy: <function.* is not a policy; .*result.policies\[0\]"),
    (lambda: A.show(3), "thing: 3 cannot be drawn"),
]


@pytest.mark.parametrize(("call", "words"), CALLS)
def test_a_wrong_argument_is_told_in_a_sentence(call: Any, words: str) -> None:
    with pytest.raises((TypeError, ValueError), match=words):
        call()


def test_numbers_of_numpy_are_numbers(tmp_path: Path) -> None:
    given: Any = {"seed": np.int64(3), "trials": np.uint8(2), "max_ticks": np.int32(2)}
    changes: Any = {"gradient_steps": np.int64(2), "p_guid": np.float32(0.5), "reuse_answers": np.bool_(True)}
    two: Any = np.int16(2)
    result = pt.train(WORLD, until="ticks:2", progress=False, **given, **changes)
    assert (type(result.seed), len(result.trials), result.config.gradient_steps) == (int, 2, 2)
    assert pt.load_result(result.save(tmp_path / "result")).config == result.config
    assert pt.evaluate(result.policies[0], episodes=two).episodes == 2
    assert pt.init(WORLD, trials=two, seed=two).waiting.shape == (2,)


@pytest.mark.parametrize(
    "wrong", [True, np.bool_(True), np.float64(3), np.int64(-1), torch.tensor([1, 2]), "3"]
)
def test_what_is_no_whole_number_is_refused(wrong: Any) -> None:
    with pytest.raises(ValueError, match=r"seed: .* is not a whole number from 0"):
        pt.train(WORLD, seed=wrong, progress=False)


def test_a_result_is_not_a_policy_and_the_message_says_where_its_policies_are(
    trained: pt.TrainResult,
) -> None:
    with pytest.raises(TypeError, match=r"policy: <TrainResult .* is not a policy; .*result.policies\[0\]"):
        pt.evaluate(trained)  # type: ignore[arg-type]


def test_a_world_of_another_shape_is_told_with_the_policys_own(policy: pt.Policy) -> None:
    with pytest.raises(ValueError, match=r"world: side-effects .*trained in unsafe-exploration.*\(6, 8, 5\)"):
        pt.evaluate(policy, "side-effects")
    with pytest.raises(TypeError, match="world: 3 is not the name of a world"):
        pt.evaluate(policy, 3)  # type: ignore[arg-type]


@pytest.mark.parametrize("code", [-1, 5, 300, 0.5])
def test_codes_that_no_tile_has_are_refused(policy: pt.Policy, code: float) -> None:
    with pytest.raises(ValueError, match="observation: codes are whole numbers from 0 to 4"):
        policy.predict(np.full((6, 8), code))


@pytest.mark.parametrize("bit", [0, 1, 2, -1, 0.2])
def test_bits_that_name_no_tile_are_refused(policy: pt.Policy, bit: float) -> None:
    with pytest.raises(ValueError, match="observation: in one-hot bits each cell has one 1"):
        policy.predict(np.full((6, 8, 5), bit))
