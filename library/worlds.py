"""Worlds by name, by a level's text, or by an object that exists already."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from parenting.envs import gym_ids, registry
from parenting.envs.gridworld import Gridworld as World
from parenting.envs.level_bytes import decode, name_by_file
from parenting.envs.levels.spec import Level, LevelError, WorldSpec
from parenting.envs.options import check_names
from parenting.envs.tables.world import TableWorld
from parenting.library.checks import check_device, check_number

__all__ = ["AnyLevel", "World", "make", "named", "read_level", "worlds"]

AnyLevel = str | Path | Level | Sequence[Level]
"""A built-in level's name, a level's text, a file's path (behind it `:` and the number or name of one of
several levels), a `Level`, or several levels of one size."""

ARGUMENTS = ("level", "max_episode_steps", "device")


def worlds() -> dict[str, tuple[str, ...]]:
    """List the worlds of the paper (Sec. 3.2), each with the names of its built-in levels.

    Returns:
        Name of the world -> names of its levels; the first level is the default.

    Example:
        >>> import parenting as pt
        >>> pt.worlds()["unsafe-exploration"]
        ('island', 'island-bottleneck')
    """
    return {name: tuple(spec.levels) for name, spec in registry.WORLDS.items()}


def make(
    world: str | TableWorld,
    level: AnyLevel | None = None,
    *,
    max_episode_steps: int | None = None,
    device: str | None = None,
    **options: Any,
) -> World:
    """Make a world (Sec. 3.2): its rules in tensors, all trials at once.

    Args:
        world: A world's name, a level's text whose header names its world, or a `TableWorld`.
        level: A built-in level's name, a level's text, the path of a file, a `Level`, or several levels of
            one size; None takes the world's default level.
        max_episode_steps: Steps after which an episode is cut off; None takes the world's default.
        device: torch's name of the device that holds the world's tables; None takes torch's default.
        **options: The rules' own settings, such as `drying` in reward-hacking and `supervised`
            ("present", "absent" or "random") in absent-supervisor.

    Returns:
        The world. Its states hold N trials; boards have shape [N, H, W] and cells [N, 2] (row, column).

    Raises:
        UnknownNameError: There is no such world, level or option; the message names the nearest.
        LevelError: A level breaks a rule; the message names line and column.
        TypeError: The world or the level is of a wrong type.
        ValueError: Levels of different sizes, a text that does not name its world, a wrong value of an
            option, a limit below 1, or a device that torch does not have.

    Example:
        >>> import parenting as pt
        >>> world = pt.make("unsafe-exploration", max_episode_steps=50)
        >>> world.height, world.width
        (6, 8)
    """
    if isinstance(world, TableWorld):
        world = of_table(world, level)
    name, found = named(world, level)
    _check_options(registry.spec(name, found), options)
    if max_episode_steps is not None:
        max_episode_steps = check_number("max_episode_steps", max_episode_steps, 1, 10**9)
    if device is not None:
        check_device(device)
    return registry.make(name, found, device=device, time_limit=max_episode_steps, **options)


def register(spec: WorldSpec) -> None:
    """Make a world of your own known by its name, to `make`, `train` and all else in this process.

    It takes the place of an earlier one of its name whose rules stand under the same "module:class", as
    after `importlib.reload` or in a notebook's cell that runs again. docs/python.md has a small one from its
    first line to a trained agent.

    Args:
        spec: What the world is; `spec.rules` names the class of its rules, as "module:class".

    Raises:
        TypeError: It is not a `WorldSpec`.
        ValueError: There is another world of this name, or a built-in level breaks a rule.

    Example:
        >>> import parenting as pt
        >>> pt.register(pt.make("side-effects").spec)  # the same again changes nothing
    """
    if not isinstance(spec, WorldSpec):
        raise TypeError(f"spec: {spec!r} is not a WorldSpec. Give pt.WorldSpec(name=..., rules=..., ...).")
    before = registry.WORLDS.get(spec.name)
    if before is not spec:  # that of an installed package stays its own
        if before is not None and (spec.name in registry.BUILT_IN or before.rules != spec.rules):
            raise ValueError(f"spec: there is another world '{spec.name}' already. Choose another name.")
        _put(spec, before)
    gymnasium = sys.modules.get("gymnasium")
    if gymnasium is not None:
        gym_ids.register(gymnasium, spec.name)


def _put(spec: WorldSpec, before: WorldSpec | None) -> None:
    """Put a world in the place of an earlier one, unless one of its levels breaks a rule."""
    registry.WORLDS[spec.name] = spec
    for name in spec.levels:
        try:
            registry.level(spec.name, name)
        except LevelError:
            del registry.WORLDS[spec.name]
            if before is not None:
                registry.WORLDS[spec.name] = before
            raise


def of_table(world: TableWorld, level: object) -> str:
    """Return the text of a table's level, which says all of its world.

    Raises:
        ValueError: A level is given beside it.
    """
    if level is not None:
        raise ValueError("level: a TableWorld has its level already. Leave level out.")
    return world.level.text


def named(world: str, level: AnyLevel | None) -> tuple[str, str | Level | Sequence[Level] | None]:
    """Return the world's name, and its level as `envs.registry.make` takes it."""
    if not isinstance(world, str):
        raise TypeError(f"world: {world!r} is not the name of a world.{path_hint(world)}")
    if "\n" not in world:
        if world not in registry.WORLDS and os.path.isfile(world):
            raise ValueError(f"world: {world!r} is a file, not a world.{path_hint(Path(world))}")
        return world, read_level(world, level)
    if level is not None:
        raise ValueError("level: the world was given as a level's text already. Leave level out.")
    name = _header(world)
    return name, read_level(name, world)


def read_level(world: str, level: AnyLevel | None) -> str | Level | Sequence[Level] | None:
    """Read a level's file or text; built-in levels are known by their names.

    One of several levels in a file is FILE:NUMBER or FILE:NAME. What is cut around the art is warned of.

    Raises:
        TypeError: it is not a level.
        ValueError: a file cannot be read.
    """
    which = None
    if isinstance(level, str) and "\n" not in level and level not in registry.spec(world).levels:
        file, _, part = level.rpartition(":")
        if os.path.isfile(level):
            level = Path(level)  # a name that is not there is told later
        elif file and part and os.path.isfile(file):
            level, which = Path(file), part
    if not isinstance(level, Path):
        return _checked(world, level)
    try:
        text, said = decode(level.read_bytes())
    except (OSError, ValueError) as error:
        raise ValueError(f"level: {level} cannot be read as text: {error}.") from None
    return _warned(registry.read_level(world, text, str(level), which, name_by_file(level.stem)), said)


def _warned(level: Level, said: tuple[str, ...] = ()) -> Level:
    """Warn of what was cut from a level's text."""
    for sentence in (*said, *level.said):
        warnings.warn(f"{level.source}: {sentence}.", stacklevel=2)
    return level


def path_hint(world: object) -> str:
    """Return what to write instead where a level's file was given as the world, after a space."""
    if isinstance(world, os.PathLike):
        file = os.fspath(world)
        return f' Name the world and give the file as level=, as in ("unsafe-exploration", level={file!r}).'
    return f" Give one of: {', '.join(registry.WORLDS)}."


def _checked(world: str, level: object) -> str | Level | Sequence[Level] | None:
    """Return a level that does not stand in a file; texts and names of people obey `envs.people_text`."""
    if isinstance(level, Level):
        return registry.named_by_a_person(level)
    if isinstance(level, str) and "\n" in level:
        return _warned(registry.read_level(world, level))
    if level is None or isinstance(level, str):
        return level
    if isinstance(level, Sequence) and all(isinstance(one, Level) for one in level):
        return [registry.named_by_a_person(one) for one in level]
    raise TypeError(
        f"level: {level!r} is not a level. Give a built-in level's name, a level's text, a file's path, a"
        " Level, or several of these Levels."
    )


def _check_options(spec: WorldSpec, options: Mapping[str, object]) -> None:
    if "time_limit" in options:
        raise TypeError("There is no argument 'time_limit'. It is max_episode_steps.")
    check_names(spec, options, ARGUMENTS)


def _header(text: str) -> str:
    """Return the world that a level's header names."""
    for line in text.splitlines():
        key, colon, value = line.partition(":")
        if colon and key.strip() == "world":
            return value.strip()
    raise ValueError(
        "world: this level's text does not name its world. Begin it with a line such as"
        " 'world: unsafe-exploration' and an empty line, or name the world and give the text as level=."
    )
