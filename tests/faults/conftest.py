"""Fixtures of the fault tests: draws by the seed of the run, figures that are printed at its end.

make faults                                     what every CI run does
PARENTING_FAULTS_SEED=7 make faults ARGS=...    the same draws again
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from parenting.server.settings import Settings
from tests.faults import seeds
from tests.faults.figures import Figures, add_up, lines


def pytest_configure() -> None:
    seeds.settle()


def pytest_report_header() -> str:
    return f"{seeds.VARIABLE}={seeds.settle()}"


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> random.Random:
    """Random numbers by the seed of the run and the name of the test."""
    print(f"{seeds.VARIABLE}={seeds.settle()}")  # shown where the test fails
    return seeds.draws(request.node.name)


@pytest.fixture
def figures(request: pytest.FixtureRequest) -> Iterator[Figures]:
    """Counts by group and name; those of all tests are added up and printed at the end."""
    counted = Figures()
    yield counted
    request.node.user_properties.append(("figures", counted.counts))


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    """A data folder of the test's own, with SQLite in it."""
    return Settings(data=tmp_path, database_url=None)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    reports = [report for kind in terminalreporter.stats.values() for report in kind]
    ended = [report for report in reports if getattr(report, "when", None) == "teardown"]
    total: Counter[tuple[str, str]] = add_up(
        value for report in ended for name, value in report.user_properties if name == "figures"
    )
    terminalreporter.section(f"figures, {seeds.VARIABLE}={seeds.settle()}")
    for line in lines(total):
        terminalreporter.write_line(line)
