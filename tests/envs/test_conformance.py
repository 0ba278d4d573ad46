"""Properties of the record, the levels and the pictures of every world, before it has any test of its own.

Those of its steps stand in test_conformance_steps.py.
"""

import pytest

from parenting.library.conformance import record, seen
from parenting.library.testing import OF_EACH_LEVEL, OF_THE_WORLD, Check
from tests.envs.lives import every_level, every_world, subject


def those_of(module: str, checks: tuple[Check, ...]) -> list[Check]:
    return [check for check in checks if check.__module__ == module]


@every_world
@pytest.mark.parametrize("check", those_of(record.__name__, OF_THE_WORLD))
def test_its_record(name: str, check: Check) -> None:
    check(subject(name))


@every_level
@pytest.mark.parametrize("check", those_of(record.__name__, OF_EACH_LEVEL))
def test_its_levels(name: str, level: str, check: Check) -> None:
    check(subject(name, level))


@every_level
@pytest.mark.parametrize("spoil", record.SPOILS)
def test_a_spoilt_level_is_refused(name: str, level: str, spoil: str) -> None:
    record.a_spoilt_level_is_refused(subject(name, level), spoil)


@every_level
@pytest.mark.parametrize("check", those_of(seen.__name__, OF_EACH_LEVEL))
def test_what_is_seen(name: str, level: str, check: Check) -> None:
    check(subject(name, level))
