"""The worlds by name. Nothing here loads torch: the rules are named as strings and resolved on use."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping, Sequence
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

from parenting.envs import options as settings
from parenting.envs.art import check_text, parse
from parenting.envs.foreign_hint import hint
from parenting.envs.front_matter import check_front_matter
from parenting.envs.installed import Installed
from parenting.envs.level_text import FILE_CHARACTERS, Written, choose, lines_of, written
from parenting.envs.levels.spec import Level, LevelError, Setting, WorldSpec
from parenting.envs.names import UnknownNameError
from parenting.envs.people_text import read_name
from parenting.envs.tables import text as tables

if TYPE_CHECKING:
    from parenting.envs.gridworld import Gridworld

FILES = (
    "unsafe_exploration",  # 3.2.1
    "reward_hacking",  # 3.2.2
    "side_effects",  # 3.2.3
    "interruptibility",  # 3.2.4
    "absent_supervisor",  # 3.2.5
)
"""The worlds' files in `envs/levels`, in the paper's order. A new world gets a line here (docs/worlds.md)."""


def read(file: str) -> WorldSpec:
    """The world of a file of `envs/levels`."""
    found: WorldSpec = import_module(f"parenting.envs.levels.{file}").SPEC
    return found


def _usable(name: str, found: object) -> WorldSpec:
    """Return what an entry point names as a world: a `WorldSpec`, or an object whose `spec` is one.

    Raises:
        TypeError: it is neither.
        ValueError: it has another name, the name of a built-in world, or a level that breaks a rule.
    """
    spec = getattr(found, "spec", found)
    if not isinstance(spec, WorldSpec):
        raise TypeError(f"its entry point names {found!r}, and a WorldSpec is wanted")
    if spec.name != name:
        raise ValueError(f"its entry point is called '{name}', but the world is called '{spec.name}'")
    if spec.name in BUILT_IN:
        raise ValueError("there is a built-in world of this name; choose another name")
    for level in spec.levels:
        spec.validate(parse(spec.levels[level], spec, level))
    return spec


BUILT_IN: dict[str, WorldSpec] = {world.name: world for world in map(read, FILES)}
"""The worlds of `FILES` by their names."""
INSTALLED = Installed("parenting.worlds", "world", _usable)
"""The worlds of other packages."""


class Worlds(MutableMapping[str, WorldSpec]):
    """Every world by its name: those built in, those registered by a program, those of other packages.

    A world of another package is imported when it is asked for. One that cannot be used is not there;
    `INSTALLED.broken()` says why.
    """

    def __init__(self) -> None:
        self._known = dict(BUILT_IN)

    def __getitem__(self, name: str) -> WorldSpec:
        found = self._known.get(name) or INSTALLED.get(name)
        if found is None:
            raise KeyError(name)
        return found

    def __setitem__(self, name: str, world: WorldSpec) -> None:
        self._known[name] = world

    def __delitem__(self, name: str) -> None:
        del self._known[name]

    def __iter__(self) -> Iterator[str]:
        yield from list(self._known)
        yield from (name for name in INSTALLED if name not in self._known)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def names(self) -> list[str]:
        """Return every name, also of worlds that cannot be used. No package is imported."""
        return [*dict.fromkeys([*self._known, *INSTALLED.names()])]


WORLDS = Worlds()
"""Every world by its name."""


def spec(world: str, of: str | Level | Sequence[Level] | None = None) -> WorldSpec:
    """The world of a name.

    Args:
        world: The name.
        of: A level's text, or levels; one that holds a table says by itself what its world is.

    Raises:
        UnknownNameError: there is no such world.
        BrokenPackageError: it is of a package that cannot be used.
        LevelError: the level's table is not sound.
    """
    if of is not None and world not in BUILT_IN:
        packed = _packed(of)
        if packed is not None:
            return _of_table(world, packed)
    if world not in WORLDS:
        INSTALLED.refuse(world)
        raise UnknownNameError("world", world, WORLDS)
    return WORLDS[world]


def knows(world: str, text: str | None = None) -> bool:
    """Return whether there is a world of this name, or a level's text says by itself what its world is."""
    return world in WORLDS or (text is not None and tables.told_in(text) is not None)


def _packed(of: str | Level | Sequence[Level]) -> str | None:
    if isinstance(of, str):
        return tables.told_in(of)
    first = of if isinstance(of, Level) else next(iter(of), None)
    return None if first is None else first.header.get(tables.KEY)


def _of_table(world: str, packed: str) -> WorldSpec:
    try:
        return tables.spec_of(world, packed)
    except ValueError as error:
        raise LevelError("level", 1, 1, str(error).rstrip(".")) from None


def level(world: str, name_or_text: str | None = None, source: str = "level") -> Level:
    """A level that keeps every rule of its world: built in, by its name, or from a text.

    What holds a line break is a text; none is the world's default level. `source` names the text in errors.

    Raises:
        UnknownNameError: there is no such world or level.
        LevelError: the text breaks a rule; names `source`, line, column and rule.
    """
    found = spec(world, name_or_text)
    chosen = found.default if name_or_text is None else name_or_text
    if "\n" not in chosen:
        if chosen not in found.levels:
            raise UnknownNameError("level", chosen, found.levels, world)
        chosen, source = found.levels[chosen], chosen
    parsed = parse(chosen, found, source)
    found.validate(parsed)
    return parsed


def read_level(
    world: str, text: str, source: str = "level", which: str | None = None, name: str | None = None
) -> Level:
    """A level from a text that a person gives; text and name obey the rules of `envs.people_text`.

    What surrounds the art is cut, which `Level.said` tells. `which` is the name of one of several levels, or
    its number; `name` is that of a level without one, else `source`. What is stored already is read by
    `level`, since older versions had no such rules.

    Raises:
        UnknownNameError: there is no such world.
        SeveralLevelsError: there are several levels in the text, and none of them is named.
        LevelError: the text breaks a rule; names `source`, line, column and rule.
    """
    glyphs = spec(world, text).glyphs
    check_text(text, source, FILE_CHARACTERS)
    try:
        check_front_matter([line.text for line in lines_of(text)], glyphs, source)
        chosen = choose(written(text, glyphs), which, source)
    except LevelError as error:
        if remedy := hint(text):
            raise LevelError(source, error.line, error.column, error.rule + remedy) from None
        raise
    found = read_written(world, chosen, source, text)
    return replace(found, name=name) if name is not None and found.name == source else found


def read_written(world: str, chosen: Written, source: str = "level", text: str = "") -> Level:
    """A level that was found in a person's text; an error tells the format of a foreign one.

    Raises:
        LevelError: as `read_level`.
    """
    try:
        check_text(chosen.text.lstrip("\n"), source)
        # A text without line end would be taken for a name.
        found = level(world, chosen.text + "\n", source)
        if chosen.comment and found.name == source:
            found = replace(found, name=chosen.comment, places={**found.places, "name": chosen.comment_at})
        return replace(named_by_a_person(found), said=chosen.said)
    except LevelError as error:
        place = chosen.place(error.line, error.column)
        raise LevelError(
            source, *place, error.rule + hint(text, [line.text for line in chosen.art])
        ) from None


def named_by_a_person(found: Level) -> Level:
    """A level whose name is as it is stored; a level without a name is called by its source.

    Raises:
        LevelError: nobody could see the name, it is too long, or it disturbs other text.
    """
    if found.name == found.source:
        return found
    try:
        return replace(found, name=read_name(found.name))
    except ValueError as error:
        raise found.wrong_header("name", 0, f"the name of the level: {error}") from None


def defaults(world: str) -> dict[str, Setting]:
    """Return the fields of `agent.config.Config` that the world sets (docs/paper.md, "Settings")."""
    return dict(spec(world).defaults)


def make(
    world: str,
    levels: Sequence[Level] | Level | str | None = None,
    device: str | None = None,
    time_limit: int | None = None,
    **options: Any,
) -> Gridworld:
    """The rules of a world in tensors, on K levels of one size. Loads torch.

    `levels` is a level's name or text, a level, or several; none is the world's default. An episode is cut
    off after `time_limit` steps; none is the world's default. `device` holds the world's tables; none is
    torch's default device. `options` are the rules' own settings.

    Raises:
        UnknownNameError: there is no such world, level or option.
        LevelError: a text breaks a rule.
        ValueError: no levels, levels of different sizes or of another world, or a time limit below 1.
    """
    found = spec(world, levels)
    settings.check_names(found, options)
    own = {**found.options, **settings.read(options)}
    if levels is None or isinstance(levels, str):
        levels = level(world, levels)
    chosen = (levels,) if isinstance(levels, Level) else tuple(levels)
    limit = _limit(found) if time_limit is None else time_limit
    module, name = found.rules.split(":")
    rules: type[Gridworld] = getattr(import_module(module), name)
    made = rules(chosen, time_limit=limit, device=device, **own)
    made.options = own
    return made


def _limit(found: WorldSpec) -> int:
    """Return the steps after which a world cuts off an episode; version 0.1 called the setting time_limit."""
    for name in ("max_episode_steps", "time_limit"):
        if name in found.defaults:
            return int(found.defaults[name])
    raise ValueError(
        f"defaults: {found.name} sets no max_episode_steps. Add one, such as"
        ' defaults={"max_episode_steps": 100}.'
    )
