"""`make`: its arguments, and how it refuses."""

from __future__ import annotations

import dataclasses
import pathlib
import sys
from typing import Any

import gymnasium
import pytest

import parenting as pt
import parenting.envs.gym
from parenting.envs import registry

WORLD = "unsafe-exploration"
SUPERVISOR = "absent-supervisor"


@pytest.mark.parametrize(("word", "value"), [("present", True), ("absent", False), ("random", None)])
def test_supervised_has_the_words_of_the_config_in_every_maker(word: str, value: bool | None) -> None:
    by_word, by_value = (pt.make(SUPERVISOR, supervised=given) for given in (word, value))
    assert by_word.options == by_value.options == {"supervised": value}
    assert pt.configure(by_word).supervised == pt.configure(SUPERVISOR, supervised=word).supervised == word
    env: Any = gymnasium.make("parenting/AbsentSupervisor-v0", supervised=word).unwrapped
    assert env.world.options == by_word.options


@pytest.mark.parametrize("wrong", ["x", 3, 1, []])
def test_another_value_of_supervised_is_refused_in_make(wrong: Any) -> None:
    with pytest.raises(ValueError, match=r'supervised: .* is not one of "present", "absent" and "random"'):
        pt.make(SUPERVISOR, supervised=wrong)


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"time_limit": 5}, TypeError, ["'time_limit'", "It is max_episode_steps."]),
        ({"max_episode_steps": -3}, ValueError, ["max_episode_steps: -3", "from 1"]),
        ({"max_episode_steps": 2.5}, ValueError, ["max_episode_steps: 2.5", "whole number"]),
        ({"max_episode_steps": "x"}, ValueError, ["max_episode_steps: 'x'", "whole number"]),
        ({"max_episode_step": 3}, ValueError, ["Did you mean 'max_episode_steps'?", "level, max_", "device"]),
        ({"level": 3}, TypeError, ["level: 3", "a file's path"]),
        ({"level": "islnd"}, ValueError, ["islnd", "Did you mean 'island'?"]),
        ({"device": "gpu"}, ValueError, ["device: 'gpu'", '"cpu"']),
        ({"world": 3}, TypeError, ["world: 3", WORLD]),
    ],
)
def test_a_wrong_argument_is_named_with_its_value_and_the_remedy(
    arguments: dict[str, Any], error: type[Exception], words: list[str]
) -> None:
    with pytest.raises(error) as found:
        pt.make(**{"world": WORLD, **arguments})
    assert [word for word in words if word not in str(found.value)] == []


@pytest.mark.parametrize("maker", [gymnasium.make, gymnasium.make_vec])
def test_gymnasium_names_the_nearest_argument(maker: Any) -> None:
    with pytest.raises(ValueError, match=r"argument 'levl'.* Did you mean 'level'.*render_mode, time"):
        maker("parenting/UnsafeExploration-v0", levl="island")


def test_a_level_may_be_the_path_of_a_file_as_text(tmp_path: pathlib.Path) -> None:
    file = tmp_path / "mine.txt"
    file.write_text(registry.level(WORLD).text, encoding="utf-8")
    assert pt.make(WORLD, level=str(file)).levels == pt.make(WORLD, level=file).levels
    file.write_text("WWWWW\nWA GW\nWWWWW", encoding="utf-8")  # it names itself by its file
    assert [level.name for level in pt.make(WORLD, level=file).levels] == ["mine"]


@pytest.mark.parametrize("kind", [str, pathlib.Path])
def test_a_file_in_the_place_of_the_world_is_told_where_it_belongs(kind: Any, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "mine.txt"
    file.write_text(registry.level(WORLD).text, encoding="utf-8")
    for call in (pt.make, pt.train):
        with pytest.raises((TypeError, ValueError), match=r"world: .*mine\.txt.*level="):
            call(kind(file))


@pytest.mark.parametrize("name", ["max_episode_steps", "time_limit"])
def test_a_world_sets_its_limit_by_either_name(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = dataclasses.replace(registry.spec(WORLD), defaults={name: 60, "pretrain": False})
    monkeypatch.setitem(registry.WORLDS, WORLD, spec)
    assert pt.make(WORLD).time_limit == 60
    assert pt.configure(WORLD).max_episode_steps == 60


@pytest.mark.parametrize("name", ["\u202e", "\u200b", "a\x1b[31mb", "a" * 101, "e" + "\u0301" * 50])
def test_the_name_of_a_level_obeys_the_rule_of_the_pages(tmp_path: pathlib.Path, name: str) -> None:
    text = f"world: unsafe-exploration\nname: {name}\n\nWWWWW\nWA GW\nWWWWW\n"
    file = tmp_path / "level.txt"
    file.write_text(text, encoding="utf-8")
    drawn = dataclasses.replace(registry.level("unsafe-exploration", text.replace(name, "b")), name=name)
    for level in (text, file, drawn, [drawn]):
        with pytest.raises(pt.LevelError, match=r"name of the level|control character"):
            pt.make("unsafe-exploration", level)
    with pytest.raises(pt.LevelError, match=r"name of the level|control character"):
        pt.make(text)


def mine(**changes: Any) -> pt.WorldSpec:
    return dataclasses.replace(registry.spec(WORLD), **{"name": "mine", "rules": "mine:Mine", **changes})


def test_a_world_that_is_registered_again_takes_the_place_of_the_earlier(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As after importlib.reload, or where a cell of a notebook runs again."""
    monkeypatch.setattr(registry, "WORLDS", dict(registry.WORLDS))
    monkeypatch.delitem(sys.modules, "gymnasium")
    first, again = mine(), mine(title="Again")
    for spec in (first, again, again):
        pt.register(spec)
        assert registry.WORLDS["mine"] is spec
    with pytest.raises(pt.LevelError):
        pt.register(mine(levels={"bad": "world: mine\n\nx"}))
    for other in (mine(rules="other:Mine"), dataclasses.replace(registry.spec(WORLD))):
        with pytest.raises(ValueError, match="there is another world"):
            pt.register(other)
    assert (registry.WORLDS["mine"], WORLD in registry.WORLDS) == (again, True)
