"""The worlds that the checks of test_conformance*.py run over, wherever they are imported."""

import pytest

from parenting.envs import registry


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "every_world: run with the `name` of every world")
    config.addinivalue_line("markers", "every_level: run with the `name` and `level` of every level")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A module's own `WORLDS`, or else those of the registry."""
    worlds = getattr(metafunc.module, "WORLDS", registry.WORLDS)
    if metafunc.definition.get_closest_marker("every_world"):
        metafunc.parametrize("name", worlds)
    if metafunc.definition.get_closest_marker("every_level"):
        levels = [(world.name, level) for world in worlds.values() for level in world.levels]
        metafunc.parametrize(("name", "level"), levels, ids=[level for _, level in levels])
