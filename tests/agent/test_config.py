"""Names of the config: those of version 0.1 are read as well, and written in published formats."""

from __future__ import annotations

import json

import pytest
from pydantic import ValidationError

from parenting.agent.config import FIELDS, V1_NAMES, Config, compose, merge

OLD = {
    "batch": 64,
    "recompare": True,
    "stages": 3,
    "mature_every": 20,
    "own_length": True,
    "time_limit": 12,
    "inside": "left",
}
STORED = json.dumps(
    {"p_guid": 0.95, "p_rec": 0.8, "p_pref": 0.8, "p_train": 1.0, "gradient_steps": 1, "lambda_global": 0.01}
    | {"lambda_local": 0.01, "learning_rate": 0.001, "gamma": 0.9, "supervised": "present", "pretrain": False}
    | {"max_open_preferences": 3, "dtype": "float32"}
    | OLD
)
"""A config as version 0.1 stored it."""


def test_every_renamed_field_exists_and_none_has_the_old_name() -> None:
    assert set(V1_NAMES) <= set(Config.model_fields)
    assert not set(FIELDS) & set(Config.model_fields)
    assert set(FIELDS) == set(OLD)


def test_a_config_that_version_0_1_stored_is_read_and_written_back_unchanged() -> None:
    config = Config.model_validate_json(STORED)
    assert {name: getattr(config, FIELDS[name]) for name in OLD} == OLD
    for written in (config.model_dump(mode="json"), json.loads(config.model_dump_json())):
        added = set(written) - set(json.loads(STORED))
        assert {name: value for name, value in written.items() if name not in added} == json.loads(STORED)
        assert all(written[name] == Config.model_fields[name].default for name in added)


def test_the_fields_own_names_are_read_and_can_be_written() -> None:
    config = Config.model_validate_json(STORED)
    own = config.model_dump(by_alias=False)
    assert set(own) == set(Config.model_fields)
    assert Config.model_validate(own, strict=True) == config


@pytest.mark.parametrize("name", list(V1_NAMES))
def test_two_names_of_one_field_are_refused_and_both_are_named(name: str) -> None:
    old = V1_NAMES[name]
    with pytest.raises(ValidationError) as caught:
        Config.model_validate({name: OLD[old], old: OLD[old]}, strict=True)
    assert f"{name} and {old} are two names of one setting" in str(caught.value)


@pytest.mark.parametrize("name", ["stages", "max_clip_length"])
def test_an_error_has_the_name_that_was_given(name: str) -> None:
    with pytest.raises(ValidationError) as caught:
        compose("lax", {}, {name: 17}, strict=True)
    assert [error["loc"] for error in caught.value.errors()] == [(name,)]


@pytest.mark.parametrize("world", ["time_limit", "max_episode_steps"])
@pytest.mark.parametrize("change", ["time_limit", "max_episode_steps"])
def test_a_later_setting_overrides_an_earlier_one_by_either_name(world: str, change: str) -> None:
    assert compose("lax", {world: 50}, {change: 7}, strict=True).max_episode_steps == 7
    assert merge({world: 50}, {change: 7}) == {change: 7}
