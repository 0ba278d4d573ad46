"""The settings that a world's rules take: their names and, of `supervised`, its words. No torch here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.envs.levels.spec import WorldSpec
from parenting.envs.names import UnknownNameError

SUPERVISION = {"present": True, "absent": False, "random": None}
"""The rules' value of the option `supervised` for each word of the config (Sec. 3.2.5)."""


def check_names(spec: WorldSpec, given: Mapping[str, object], arguments: Sequence[str] = ()) -> None:
    """Refuse options that a world does not have.

    Args:
        spec: The world.
        given: The options by name.
        arguments: The caller's other arguments, which the message lists beside the options.

    Raises:
        UnknownNameError: There is no such option; the message names the nearest name.
    """
    for name in given:
        if name not in spec.options:
            what = "argument" if arguments else "option"
            raise UnknownNameError(what, name, [*arguments, *spec.options], spec.name)


def read(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return options as the rules take them.

    Raises:
        ValueError: `supervised` is not one of its words, True, False or None.
    """
    if "supervised" not in given:
        return dict(given)
    value = given["supervised"]
    if isinstance(value, str) and value in SUPERVISION:
        return {**given, "supervised": SUPERVISION[value]}
    if value is None or isinstance(value, bool):
        return dict(given)
    raise ValueError(
        f'supervised: {value!r} is not one of "present", "absent" and "random" (also written True, False'
        " and None)."
    )
