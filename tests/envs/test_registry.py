"""Names that exist, names that do not, and what `make` takes."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from parenting.envs import registry
from parenting.envs.levels.spec import Setting, WorldSpec
from parenting.envs.names import UnknownNameError

POND = "WWWW\nWA W\nW GW\nWWWW\n"


def test_the_five_worlds_of_the_paper_stand_in_its_order() -> None:
    assert list(registry.WORLDS)[:5] == [
        "unsafe-exploration",
        "reward-hacking",
        "side-effects",
        "interruptibility",
        "absent-supervisor",
    ]


def test_the_first_level_is_the_default() -> None:
    assert registry.level("unsafe-exploration") == registry.level("unsafe-exploration", "island")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: registry.spec("garden"),
            f"There is no world 'garden'. The worlds are: {', '.join(registry.WORLDS)}.",
        ),
        (
            lambda: registry.level("unsafe-exploration", "atoll"),
            "There is no level 'atoll' of unsafe-exploration. The levels are: island, island-bottleneck.",
        ),
        (
            lambda: registry.make("side-effect"),
            "There is no world 'side-effect'. Did you mean 'side-effects'? "
            f"The worlds are: {', '.join(registry.WORLDS)}.",
        ),
        (
            lambda: registry.level("unsafe-exploration", "islnd"),
            "There is no level 'islnd' of unsafe-exploration. Did you mean 'island'? "
            "The levels are: island, island-bottleneck.",
        ),
        (
            lambda: registry.make("reward-hacking", dryng=0.1),
            "There is no option 'dryng' of reward-hacking. Did you mean 'drying'? The options are: drying.",
        ),
        (
            lambda: registry.make("unsafe-exploration", drying=0.1),
            "There is no option 'drying' of unsafe-exploration. The options are: none.",
        ),
    ],
)
def test_a_name_that_does_not_exist_is_answered_with_those_that_do(
    call: Callable[[], object], message: str
) -> None:
    with pytest.raises(UnknownNameError) as caught:
        call()
    assert str(caught.value) == message


def test_make_takes_names_texts_levels_and_several() -> None:
    pond = registry.level("unsafe-exploration", POND)
    assert registry.make("unsafe-exploration", "island-bottleneck").levels[0].name == "island-bottleneck"
    assert registry.make("unsafe-exploration", POND).levels == (pond,)
    assert registry.make("unsafe-exploration", pond).levels == (pond,)
    assert registry.make("unsafe-exploration", [pond, pond]).levels == (pond, pond)


def test_make_refuses_what_does_not_go_together() -> None:
    pond = registry.level("unsafe-exploration", POND)
    island = registry.level("unsafe-exploration", "island")
    with pytest.raises(ValueError, match="one size: 'island' is 6 x 8, 'level' is 4 x 4"):
        registry.make("unsafe-exploration", [island, pond])
    with pytest.raises(ValueError, match="at least one level"):
        registry.make("unsafe-exploration", [])
    with pytest.raises(ValueError, match="'level' is of the world garden, not of unsafe-exploration"):
        registry.make("unsafe-exploration", replace(pond, world="garden"))
    with pytest.raises(ValueError, match="time_limit must be at least 1, not 0"):
        registry.make("unsafe-exploration", time_limit=0)


def test_the_defaults_handed_out_are_a_copy() -> None:
    registry.defaults("unsafe-exploration")["gamma"] = 0.5
    assert registry.defaults("unsafe-exploration") == {
        "gamma": 0.9,
        "max_episode_steps": 100,
        "pretrain": False,
    }


def with_defaults(defaults: dict[str, Setting]) -> WorldSpec:
    return replace(registry.spec("unsafe-exploration"), defaults=defaults)


@pytest.mark.parametrize("name", ["max_episode_steps", "time_limit"])
def test_a_world_sets_its_limit_of_steps_by_todays_name_or_that_of_version_0_1(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(registry.WORLDS, "unsafe-exploration", with_defaults({name: 7}))
    assert registry.make("unsafe-exploration").time_limit == 7


def test_a_world_without_a_limit_of_steps_is_told_to_set_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(registry.WORLDS, "unsafe-exploration", with_defaults({"gamma": 0.9}))
    with pytest.raises(ValueError, match="defaults: unsafe-exploration sets no max_episode_steps"):
        registry.make("unsafe-exploration")
