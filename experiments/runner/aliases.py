"""The names under which version 0.1.0 stored results, for today's names.

Each file of results says which function made it, with which arguments and settings. A folder that the version
before this one made is therefore compared with what is wanted in its own words, too: so it opens, and the
same command goes on from there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

CALLS: Mapping[str, str] = {
    "parenting.experiments.calibrate.tasks:confirm_trials": "experiments.calibrate:confirm_some",
    "parenting.experiments.calibrate.tasks:try_direct": "experiments.calibrate:try_direct",
    "parenting.experiments.calibrate.tasks:try_reward": "experiments.calibrate:try_reward",
    "parenting.experiments.figure2.tasks:arm_trials": "experiments.maturing:live_some",
    "parenting.experiments.figure2.tasks:full_coverage_stages": "experiments.maturing:cover_some",
    "parenting.experiments.figure2.tasks:lookahead_waterings": "experiments.maturing:ahead_some",
    "parenting.experiments.figure2.tasks:reinforce_trials": "experiments.maturing:reward_some",
    "parenting.experiments.figure3.levels:find_levels": "experiments.unsolved_levels:find_levels",
    "parenting.experiments.figure3.tasks:parent_trials": "experiments.generalising:parent_some",
    "parenting.experiments.figure3.tasks:pre_parent": "experiments.generalising:pre_parent",
    "parenting.experiments.figure4.tasks:fit_and_shift": "experiments.figure4:shift_some",
    "parenting.experiments.reward_hacking.tasks:snapshot_trials": "experiments.reward_hacking:bucket_some",
    "parenting.experiments.training.tasks:parent_trials": "experiments.raising:parent_some",
    "parenting.experiments.training.tasks:reinforce_trials": "experiments.raising:reward_some",
    "parenting.experiments.value_iteration.tasks:mature_trials": "experiments.value_iteration:iterate_some",
}
"""Task.call -> the same in version 0.1.0."""

ARGUMENTS: Mapping[str, str] = {
    "budget": "pace",
    "evaluation_points": "looks",
    "hyperparameters": "knobs",
}
"""Argument of a task -> the same in version 0.1.0."""


LATER: Mapping[str, Any] = {
    "confirm": 0.0,
    "fresh_pairs": False,
    "late_steps": False,
    "learn_refusals": False,
    "relabel": False,
    "reuse_answers": False,
}
"""Settings that came after version 0.4, and their values where they are off: then they change no result."""


def without_later(data: Any) -> Any:
    """Return plain data without the settings that came later, where they are off, at any depth."""
    if isinstance(data, Mapping):
        kept = {key: value for key, value in data.items() if key not in LATER or value != LATER[key]}
        return {key: without_later(value) for key, value in kept.items()}
    return [without_later(value) for value in data] if isinstance(data, list) else data


def before(data: Any) -> Any:
    """Return plain data in the words of version 0.1.0: calls, and keys of mappings at any depth."""
    return _old_words(without_later(data))


def _old_words(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {ARGUMENTS.get(key, key): _old_words(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_old_words(value) for value in data]
    return CALLS.get(data, data) if isinstance(data, str) else data
