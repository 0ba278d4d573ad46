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

from parenting.server.db import Database
from parenting.server.new_run import NewRun, start
from parenting.server.runs import Claim, claim
from parenting.server.settings import Settings
from tests.database import STORES, database_url, migrated
from tests.faults import seeds
from tests.faults.auditor import Store
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
    postgresql = request.node.get_closest_marker("postgresql") is not None
    counted = Figures("PostgreSQL: " if postgresql else "")
    yield counted
    request.node.user_properties.append(("figures", counted.counts))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run what uses a database on both stores, unless it is about one or says itself which."""
    chosen = any("store" in mark.args[0] for mark in metafunc.definition.iter_markers("parametrize"))
    if "store" in metafunc.fixturenames and not chosen:
        only = metafunc.definition.get_closest_marker("only")
        metafunc.parametrize("store", only.args[:1] if only else STORES, indirect=True)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is in this folder, and of it PostgreSQL's share, which is run apart."""
    here = Path(__file__).parent
    for item in items:
        if item.path.is_relative_to(here):
            item.add_marker("faults")
        callspec = getattr(item, "callspec", None)
        if callspec is not None and callspec.params.get("store") == "postgresql":
            item.add_marker("postgresql")


@pytest.fixture
def store(request: pytest.FixtureRequest) -> str:
    """The kind of database: sqlite or postgresql."""
    kind: str = request.param
    return kind


@pytest.fixture
def settings(tmp_path: Path, store: str) -> Iterator[Settings]:
    """A data folder of the test's own, and a database that does not exist yet."""
    with database_url(store) as url:
        yield Settings(data=tmp_path, database_url=url)


@pytest.fixture
def db(settings: Settings) -> Iterator[Database]:
    """The database, with tables and without rows."""
    database = migrated(settings)
    yield database
    database.close()


@pytest.fixture
def mine(db: Database) -> Claim:
    """The claim of one worker on one run."""
    start(db, NewRun(world="unsafe-exploration", config={}))
    (only,) = claim(db, "worker")
    return only


@pytest.fixture
def kept(settings: Settings) -> Store:
    """The database, for the auditor."""
    url = settings.database_url
    return Store(settings.data / "parenting.db" if url is None else url)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    reports = [report for kind in terminalreporter.stats.values() for report in kind]
    ended = [report for report in reports if getattr(report, "when", None) == "teardown"]
    total: Counter[tuple[str, str]] = add_up(
        value for report in ended for name, value in report.user_properties if name == "figures"
    )
    terminalreporter.section(f"figures, {seeds.VARIABLE}={seeds.settle()}")
    for line in lines(total):
        terminalreporter.write_line(line)
