"""Hyperparameters by their names of version 0.1, which published formats keep."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import pytest

import parenting as pt
from parenting.agent.config import FIELDS

WORLD = "unsafe-exploration"


def test_the_config_of_a_saved_result_can_be_passed_back(tmp_path: pathlib.Path) -> None:
    result = pt.train(WORLD, until="ticks:2", progress=False, max_episode_steps=30, max_clip_length=2)
    saved = result.save(tmp_path / "res")
    config = json.loads((saved / "result.json").read_text(encoding="utf-8"))["config"]
    assert set(config) & set(FIELDS)  # else this test shows nothing
    places: list[Any] = [WORLD, pt.make(WORLD), pt.make(WORLD).levels[0]]
    for place in places:
        with pytest.warns(FutureWarning, match="stages is now max_clip_length") as warned:
            assert pt.configure(place, **config) == result.config
        assert [one.filename for one in warned] == [__file__]
    with pytest.warns(FutureWarning, match="time_limit is now max_episode_steps") as warned:
        assert pt.train(WORLD, until="ticks:2", progress=False, **config).config == result.config
    assert [one.filename for one in warned] == [__file__]


def test_a_wrong_value_by_an_old_name_is_told_by_the_new_one() -> None:
    with (
        pytest.warns(FutureWarning),
        pytest.raises(ValueError, match=r"max_clip_length=99: .*less than or equal to 16"),
    ):
        pt.configure(WORLD, stages=99)


def test_both_names_of_a_hyperparameter_are_refused() -> None:
    with pytest.raises(TypeError, match="max_clip_length and stages are two names of one setting"):
        pt.configure(WORLD, stages=2, max_clip_length=3)
