"""Properties of a world's record and of its levels."""

from __future__ import annotations

from collections.abc import Callable

import torch

from parenting.agent.config import FIELDS, Config
from parenting.envs import registry
from parenting.envs.gym_render import PALETTE
from parenting.envs.levels.spec import AGENT, LAND, WALL, LevelError
from parenting.library.conformance.walks import Subject, explore

Spoil = Callable[[list[str]], list[str]]

SPOILS: dict[str, tuple[Spoil, str]] = {
    "a longer row": (lambda rows: [rows[0] + WALL, *rows[1:]], "one length"),
    "a shorter row": (lambda rows: [*rows[:-1], rows[-1][:-1]], "one length"),
    "an unknown glyph": (lambda rows: ["?" + rows[0][1:], *rows[1:]], "not a glyph"),
    "a tab": (lambda rows: ["\t" + rows[0][1:], *rows[1:]], "tab"),
    "no agent": (lambda rows: [row.replace(AGENT, LAND) for row in rows], "has none"),
    "two agents": (lambda rows: [AGENT + rows[0][1:], *rows[1:]], "another"),
    "no rows": (lambda rows: [], "empty"),
    "two rows": (lambda rows: rows[:2], "at least 3 x 3"),
    "two columns": (lambda rows: [row[:2] for row in rows], "at least 3 x 3"),
    "too many rows": (lambda rows: rows + [WALL * len(rows[0])] * 64, "at most 64 x 64"),
    "too many columns": (lambda rows: [row + WALL * 64 for row in rows], "at most 64 x 64"),
}
"""Ways to spoil a level, each with words of the rule that it breaks."""


def the_legend_has_wall_land_and_agent_and_a_colour_for_each_tile(of: Subject) -> None:
    """The legend begins with wall and land, knows the agent, and Gymnasium can paint each tile."""
    spec = of.spec
    of.hold(spec.glyphs[:2] == WALL + LAND, f"legend: it must begin with '{WALL}' and '{LAND}'")
    of.hold(AGENT in spec.glyphs, f"legend: it needs the agent, '{AGENT}'")
    of.hold(all(len(glyph) == 1 for glyph in spec.legend), "legend: a glyph is one character")
    of.hold(len(set(spec.legend.values())) == len(spec.legend), "legend: two tiles have one name")
    bare = set(spec.legend.values()) - set(PALETTE) - set(spec.colours)
    of.hold(not bare, f"colours: {', '.join(sorted(bare))} has none; add one to the world's colours")


def the_record_says_what_the_parent_must_know(of: Subject) -> None:
    """Title and brief are there, without blanks around them."""
    for name, text in (
        ("title", of.spec.title),
        ("brief.goal", of.spec.brief.goal),
        ("brief.danger", of.spec.brief.danger),
    ):
        of.hold(text == text.strip() != "", f"{name}: {text!r} is empty, or has blanks around it")


def its_defaults_are_fields_of_the_config(of: Subject) -> None:
    """Each default is a hyperparameter with a value that it may have."""
    config = Config(**registry.defaults(of.world))  # type: ignore[arg-type]  # the check is that it takes them
    known = {*Config.model_fields, *FIELDS}
    of.hold(set(of.spec.defaults) <= known, "defaults: they name what is not a hyperparameter")
    limit = of.make().time_limit
    of.hold(config.max_episode_steps == limit, f"max_episode_steps: the rules take {limit}")


def the_rules_are_those_of_the_record(of: Subject) -> None:
    """The class that `rules` names has this record."""
    world = of.make()
    of.hold(world.spec is of.spec, f"rules: the spec of {of.spec.rules} is another one")
    of.hold((world.name, world.legend) == (of.world, of.spec.glyphs), "rules: name or legend differ")
    of.hold([level.name for level in world.levels] == [of.level], "rules: the levels differ")


def a_level_comes_back_from_its_text(of: Subject) -> None:
    """The text of a level that was read gives the same level."""
    parsed = of.drawn
    of.hold(parsed.name == of.level, f"the level calls itself '{parsed.name}'")
    of.hold(registry.level(of.world, parsed.text) == parsed, "its text gives another level")


def the_plain_search_reaches_what_step_reaches(of: Subject) -> None:
    """`reach` finds the cells that steps come to; where steps are left to chance, at least those."""
    world = of.make_certain()
    states = explore(world)
    found = {(row, column) for row, column in states.agent.tolist()}
    reach = of.spec.reach(of.drawn)
    of.hold(found <= reach, f"reach: step also comes to {sorted(found - reach)}")
    sure = all(
        bool((world.likelihood(states, torch.full_like(states.step_count, action)) == 1).all())
        for action in range(4)
    )
    of.hold(found == reach or not sure, f"reach: step never comes to {sorted(reach - found)}")


def a_spoilt_level_is_refused(of: Subject, spoil: str) -> None:
    """A level that breaks a rule of all worlds is refused by line, column and rule."""
    change, rule = SPOILS[spoil]
    text = "\n".join(["name: spoilt", "", *change(list(of.drawn.rows)), ""])
    try:
        registry.level(of.world, text, source="spoilt.txt")
    except LevelError as error:
        of.hold(rule in error.rule, f"a level with {spoil} is refused for another reason: {error}")
        of.hold(error.source == "spoilt.txt", f"the refusal of {spoil} does not name the level's source")
        return
    of.hold(False, f"a level with {spoil} is not refused")
