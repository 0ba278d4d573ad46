"""One training task from what a caller gives: a world on its levels, and every hyperparameter."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError
from torch import Tensor

from parenting.agent.beginning import Beginning
from parenting.agent.config import FIELDS, Config, compose, merge, too_large
from parenting.agent.init import world_of
from parenting.envs import registry
from parenting.envs.levels.spec import Level, WorldSpec
from parenting.envs.names import did_you_mean
from parenting.envs.options import SUPERVISION
from parenting.envs.tables.world import TableWorld
from parenting.experiments.training.stop_rule import StopRule, read_stop_rule
from parenting.library.worlds import AnyLevel, World, named, of_table, path_hint
from parenting.server.beginnings import beginning
from parenting.weights.origin import NO_ORIGIN, Origin
from parenting.weights.store import Wanted, find, load


class Task(NamedTuple):
    """A world, the hyperparameters, and the pre-trained weights where the config asks for them."""

    world: World
    config: Config
    weights: Tensor | None
    origin: Origin = NO_ORIGIN  # the files that it begins with

    @property
    def beginning(self) -> Beginning:
        """The weights and answers of an earlier agent that these begin with."""
        return beginning(self.origin, self.world, self.config)


def prepare(
    world: str | World | Level | TableWorld,
    level: AnyLevel | None,
    preset: str | Config,
    changes: Mapping[str, object],
    origin: Origin = NO_ORIGIN,
) -> Task:
    """Compose a task: the preset, over it the world's own defaults, over it the changes.

    A change may have its name of version 0.1, with a warning.

    Raises:
        TypeError: a change is not a hyperparameter; the message names the nearest.
        ValueError: a world, level, preset or hyperparameter is wrong, or does not fit what the training
            begins with; the message names it.
    """
    changes = _new_names(changes)
    if isinstance(world, TableWorld):
        world = of_table(world, level)
    if isinstance(world, Level):
        return prepare(registry.make(world.world, world), level, preset, changes, origin)
    if isinstance(world, str):
        name, found = named(world, level)
        config = compose_config(registry.spec(name, found), preset, changes)
        made = world_of(name, found, config)
    elif not isinstance(world, World):
        raise TypeError(f"world: {world!r} is not the name of a world, a World or a text.{path_hint(world)}")
    else:
        if level is not None:
            raise ValueError("level: this world has its levels already. Leave level out, or name the world.")
        made = world
        config = compose_config(world.spec, preset, {**_settings(world), **changes})
    if config.gamma == 1 and not made.spec.ends_at_goal:
        raise ValueError(f"gamma: it must be below 1 in {made.name}, where rewards never end; try gamma=0.9.")
    if wrong := origin.misfits(made.levels[0], config):
        raise ValueError("\n".join(f"{field}: {said}" for field, said in wrong))
    drawn = origin.policy is not None or not config.pretrain
    return Task(made, config, None if drawn else _weights(made), origin)


def compose_config(world: WorldSpec, preset: str | Config, changes: Mapping[str, object]) -> Config:
    """Return the config of a run in a world, with a sentence for everything that is wrong.

    A `Config` keeps what it has, since it may be that of a stored run, of a version with other bounds.
    """
    changes = {name: one.item() if isinstance(one, np.generic) else one for name, one in changes.items()}
    for name in changes:
        if name not in Config.model_fields:
            hint, known = did_you_mean(name, Config.model_fields), ", ".join(Config.model_fields)
            raise TypeError(f"There is no argument or hyperparameter '{name}'.{hint} There is: {known}.")
    try:
        config = _composed(world, preset, changes)
    except ValidationError as error:
        raise ValueError("\n".join(_sentence(one, changes) for one in error.errors())) from None
    if large := [f"{name}: {said}" for name, said in too_large(config).items() if name in changes]:
        raise ValueError("\n".join(large))
    return config


def _composed(world: WorldSpec, preset: str | Config, changes: Mapping[str, object]) -> Config:
    if isinstance(preset, Config):
        return Config.model_validate(merge(preset.model_dump(by_alias=False), changes), strict=True)
    if not isinstance(preset, str):
        raise TypeError(f"preset: {preset!r} is neither the name of a preset nor a Config.")
    return compose(preset, dict(world.defaults), changes, strict=True)


def stop_rule(world: World, until: str) -> StopRule:
    """Return the rule that `until` names.

    Raises:
        ValueError: it is not a rule, or the world has no goal and so no optimal policy.
    """
    try:
        return read_stop_rule(str(until), world.spec)
    except ValueError as error:
        raise ValueError(f"until: {error}") from None


def _new_names(changes: Mapping[str, object]) -> dict[str, object]:
    """Return changes by their names of this version; warn about those of version 0.1.

    Raises:
        TypeError: a hyperparameter is given by both of its names.
    """
    found = {name: value for name, value in changes.items() if name not in FIELDS}
    old = [name for name in changes if name in FIELDS]
    for name in old:
        if FIELDS[name] in found:
            raise TypeError(f"{FIELDS[name]} and {name} are two names of one setting: give one of them.")
        found[FIELDS[name]] = changes[name]
    if old:
        renamed = ", ".join(f"{name} is now {FIELDS[name]}" for name in old)
        warnings.warn(
            f"{renamed}; the old names will go with the next version.", FutureWarning, stacklevel=4
        )  # at the line that calls `train` or `configure`
    return found


def _settings(world: World) -> dict[str, object]:
    """Return the hyperparameters that a world holds already, so that nobody gives them twice."""
    found: dict[str, object] = {"max_episode_steps": world.time_limit}
    if "supervised" in world.options:
        given = world.options["supervised"]
        found["supervised"] = next(word for word, option in SUPERVISION.items() if option is given)
    return found


def _sentence(error: Any, given: Mapping[str, object]) -> str:
    if not error["loc"]:
        return str(error["msg"])
    name = str(error["loc"][0])
    return f"{name}={given.get(name)!r}: {error['msg']}. {Config.model_fields[name].description}"


def _weights(world: World) -> Tensor:
    """Return the pre-trained weights of a world: a person's own, or else the shipped ones (Sec. 3.1.4)."""
    from parenting.server.settings import Settings

    wanted = Wanted(world.spec, world.height, world.width)
    return load(find(wanted, Settings().weights).read_bytes(), wanted)
