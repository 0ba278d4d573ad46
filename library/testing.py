"""Checks of a world of one's own, by one line in a test: `pt.testing.check_world`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from parenting.envs import registry
from parenting.envs.levels.spec import WorldSpec
from parenting.envs.tables.world import TableWorld
from parenting.library.conformance import record, seen, steps
from parenting.library.conformance.walks import ConformanceError, Subject
from parenting.library.worlds import World, register

__all__ = ["ConformanceError", "check_world"]

Check = Callable[[Subject], None]

OF_THE_WORLD: tuple[Check, ...] = (
    record.the_legend_has_wall_land_and_agent_and_a_colour_for_each_tile,
    record.the_record_says_what_the_parent_must_know,
    record.its_defaults_are_fields_of_the_config,
    record.the_rules_are_those_of_the_record,
    steps.levels_of_one_size_live_in_one_batch,
)
"""The properties of a world, checked on its default level."""
OF_EACH_LEVEL: tuple[Check, ...] = (
    record.a_level_comes_back_from_its_text,
    steps.shapes_dtypes_and_codes,
    steps.nothing_is_changed_in_place,
    steps.a_batch_is_its_trials_one_by_one,
    steps.no_rule_reads_the_step_count,
    steps.over_stays_over,
    steps.every_living_step_counts,
    steps.the_forecast_is_the_step_where_nothing_is_left_to_chance,
    record.the_plain_search_reaches_what_step_reaches,
    seen.the_observation_is_a_function_of_the_truth_for_any_leading_axes,
    seen.the_start_is_seen_as_it_was_drawn,
    seen.the_local_state_is_read_off_the_observation,
)
"""The properties of each level of a world."""
LIVES, STEPS = 8, 30
"""Random lives that are lived twice, and their steps."""


def check_world(
    world: str | WorldSpec | World | TableWorld, *, certain: Mapping[str, Any] | None = None
) -> None:
    """Check that a world has what every world has, so that agents can be raised in it.

    Its record, its built-in levels and what spoils them; that the plain search finds what steps reach; that
    observations, steps and rewards have their shapes, change nothing in place, are the same in a batch and
    alone, draw by key, read no step count, and stay at their end.

    Args:
        world: A world's name, its `WorldSpec`, which is registered if it is not yet, a `TableWorld`,
            or a world made of one.
        certain: The options that leave nothing to chance, such as `{"drying": 0.0}`, for a world whose steps
            are left to chance and whose `likelihood` does not say so.

    Raises:
        ConformanceError: It lacks a property; the message names world, level and property. It is an
            AssertionError, so a test that calls this fails with the message.
        TypeError: It is not a world.
        UnknownNameError: There is no world of this name.

    Example:
        >>> import parenting as pt
        >>> pt.testing.check_world("unsafe-exploration")
    """
    spec = _spec(world)
    register(spec)
    subjects = [Subject(spec.name, level, certain or {}) for level in spec.levels]
    for check in OF_THE_WORLD[:-1]:
        check(subjects[0])
    for subject in subjects:
        for check in OF_EACH_LEVEL:
            check(subject)
        for spoil in record.SPOILS:
            record.a_spoilt_level_is_refused(subject, spoil)
    OF_THE_WORLD[-1](subjects[0])  # it would find most faults of a step, and not name them
    for seed in range(LIVES):
        steps.the_same_keys_give_the_same_life(subjects[0], seed, steps.random_actions(seed, STEPS))


def _spec(world: object) -> WorldSpec:
    """Return the record of what was given."""
    if isinstance(world, str):
        return registry.spec(world)
    found = getattr(world, "spec", world)
    if not isinstance(found, WorldSpec):
        raise TypeError(f"world: {world!r} is not a world. Give its name or its WorldSpec.")
    return found
