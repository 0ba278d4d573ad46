"""A database is moved from SQLite to PostgreSQL and back, equal; ends that cannot be used are refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import delete, inspect, select, text

from parenting.server.chain import check
from parenting.server.checkpoints import save_checkpoint
from parenting.server.db import Database, connect
from parenting.server.errors import SetupError
from parenting.server.export import rows as exported
from parenting.server.migrate import VERSIONS
from parenting.server.new_run import NewRun, start
from parenting.server.queue.answers import answer
from parenting.server.runs import claim
from parenting.server.settings import Settings
from parenting.server.store.sqlite import sqlite_module
from parenting.server.tables import Run, Table
from parenting.server.transfer import rows
from parenting.server.transfer.copying import copy
from tests.database import STORES, migrated, unmigrated
from tests.postgres import cluster

OTHER = {"sqlite": "postgresql", "postgresql": "sqlite"}
Open = Callable[[str], Database]


@pytest.fixture
def opened() -> Iterator[Open]:
    """Open a database by its place."""
    databases: list[Database] = []

    def open_it(named: str) -> Database:
        url = named if "://" in named else f"sqlite:///{named}"
        databases.append(connect(Settings(data=Path("/nowhere"), database_url=url)))
        return databases[-1]

    yield open_it
    for one in databases:
        one.close()


@pytest.fixture
def place(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Callable[[str], str]]:
    """Name a new database of a store; PostgreSQL's is there, with empty tables or, for one test, without."""
    names: list[str] = []
    tabled = "moved_there_and_back" not in request.node.name

    def name(store: str) -> str:
        if store == "sqlite":
            return str(tmp_path / f"moved-{len(list(tmp_path.iterdir()))}.db")
        names.append(cluster().new_name())
        url = cluster().url(names[-1])
        make = migrated if tabled else unmigrated
        make(Settings(data=tmp_path, database_url=url)).close()
        return url

    yield name
    for one in names:
        cluster().drop(one)


@pytest.fixture
def home(settings: Settings, db: Database, guidance: int) -> str:
    """A database that nobody uses: a run with an answer and a large checkpoint, and one that was deleted."""
    answer(db, guidance, "left", "tab", "human")
    start(db, NewRun(world="reward-hacking", parent="scripted", name="Größe ✓"))
    (mine,) = claim(db, "worker-2")
    save_checkpoint(db, mine, 7, bytes(range(256)) * 20_000)
    gone = start(db, NewRun(world="side-effects")).id
    with db.write() as session:
        session.execute(delete(Run).where(Run.id == gone))
    db.close()
    return settings.database_url or str(settings.data / "parenting.db")


def contents(db: Database) -> dict[str, list[tuple[Any, ...]]]:
    with db.read() as session:
        return {
            table.name: [
                tuple(row) for row in session.execute(select(table).order_by(*table.primary_key.columns))
            ]
            for table in Table.metadata.sorted_tables
        }


def next_run(db: Database) -> int:
    return start(db, NewRun(world="side-effects", parent="scripted")).id


def test_every_table_is_ours_to_copy(settings: Settings, db: Database) -> None:
    there = set(inspect(db.engine).get_table_names())
    assert there == {*Table.metadata.tables, VERSIONS.name}


def test_a_database_is_equal_after_it_was_moved_there_and_back(
    store: str, home: str, place: Callable[[str], str], opened: Open, tmp_path: Path
) -> None:
    there, back = place(OTHER[store]), place(store)
    told: list[tuple[int, int]] = []
    done = copy(home, there, tmp_path, progress=lambda *now: told.append(now))
    assert "2 runs, 1 question, 1 answer, 1 checkpoint" in str(done)
    assert told[-1][0] == told[-1][1] > 0
    copy(there, back, tmp_path)
    first, moved, returned = opened(home), opened(there), opened(back)
    wanted = contents(first)
    again, now, identity = contents(returned), contents(moved), "database_identity"
    assert store == "postgresql" or again == wanted
    # Its counters keep deleted numbers; SQLite keeps them in the identity, where they stay.
    for one in (now, again, wanted):
        one[identity] = [row[:4] for row in one[identity]]
    assert again == now == wanted
    assert list(exported(moved, 1)) == list(exported(first, 1))
    assert not check(moved, 1).problems
    assert next_run(moved) == next_run(returned) == next_run(first) == 4  # 3 was given already


def test_a_target_that_holds_something_is_refused(
    store: str, home: str, place: Callable[[str], str], tmp_path: Path
) -> None:
    there = place(OTHER[store])
    copy(home, there, tmp_path)
    with pytest.raises(SetupError, match="The target is not empty"):
        copy(home, there, tmp_path)
    with pytest.raises(SetupError, match=r"The target is not empty|in use"):
        copy(home, home, tmp_path)


def test_a_source_in_use_is_refused_unless_a_moment_of_it_will_do(
    store: str, home: str, place: Callable[[str], str], opened: Open, tmp_path: Path
) -> None:
    used, there = opened(home), place(OTHER[store])
    with used.write() as session:
        session.execute(text("SELECT 1"))
    with pytest.raises(SetupError, match="in use"):
        copy(home, there, tmp_path)
    assert "2 runs" in str(copy(home, there, tmp_path, snapshot=True))


@pytest.mark.slow
def test_a_source_that_somebody_changes_meanwhile_is_refused_and_may_be_copied_again(
    store: str, home: str, place: Callable[[str], str], opened: Open, tmp_path: Path
) -> None:
    there = place(OTHER[store])
    others: list[Database] = []

    def come(done: int, total: int) -> None:
        if not others:
            others.append(opened(home))
            start(others[0], NewRun(world="reward-hacking", parent="scripted"))

    with pytest.raises(SetupError, match="is in use"):
        copy(home, there, tmp_path, progress=come)
    others[0].close()
    assert "3 runs" in str(copy(home, there, tmp_path))


@pytest.mark.slow
def test_what_was_interrupted_has_left_nothing_and_is_begun_again(
    store: str, home: str, place: Callable[[str], str], tmp_path: Path
) -> None:
    there = place(OTHER[store])

    def interrupt(done: int, total: int) -> None:
        if done > total / 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        copy(home, there, tmp_path, progress=interrupt)
    assert not Path(there).exists()
    assert not list(tmp_path.glob("*.part*"))
    assert "2 runs" in str(copy(home, there, tmp_path))


@pytest.mark.slow
def test_a_copy_that_is_not_equal_is_refused(
    store: str, home: str, place: Callable[[str], str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there, write = place(OTHER[store]), rows.write

    def lose_a_moment(connection: Any, table: Any, batch: Any) -> None:
        lost = [(*row[:-1], None) if table.name == "checkpoint" else row for row in batch]
        write(connection, table, lost)

    monkeypatch.setattr(rows, "write", lose_a_moment)
    with pytest.raises(SetupError, match="checkpoint is not equal"):
        copy(home, there, tmp_path)
    monkeypatch.undo()
    copy(home, there, tmp_path)


@pytest.mark.slow
@pytest.mark.only("sqlite", "PostgreSQL lets no such value in")
def test_a_damaged_value_is_named_and_nothing_is_copied(
    settings: Settings, home: str, place: Callable[[str], str], tmp_path: Path
) -> None:
    with sqlite_module().connect(home) as database:
        database.execute("UPDATE run SET tick = 'many' WHERE id = 2")
    database.close()
    there = place("postgresql")
    with pytest.raises(SetupError, match=r"run\.tick is not a whole number \(id 2\)"):
        copy(home, there, tmp_path)
    with sqlite_module().connect(home) as database:
        database.execute("UPDATE run SET tick = 0, name = 'a' || char(0) WHERE id = 2")
    database.close()
    with pytest.raises(SetupError, match=r"table run cannot be stored in the target: .*NUL"):
        copy(home, there, tmp_path)


@pytest.mark.parametrize("store", STORES[:1], indirect=True)
@pytest.mark.parametrize(
    ("named", "said"),
    [
        ("mysql://me:p4ss@there/x", "mysql is neither sqlite nor postgresql"),
        ("postgresql://me:p4ss@there:port/x", "this is not a URL"),
        ("nothing.db", "cannot be read"),
    ],
)
def test_a_place_that_is_no_database_is_refused_without_its_password(
    settings: Settings, tmp_path: Path, named: str, said: str
) -> None:
    with pytest.raises(SetupError, match=said) as refused:
        copy(named, str(tmp_path / "new.db"), tmp_path)
    assert "p4ss" not in refused.value.message


@pytest.mark.parametrize("store", STORES[:1], indirect=True)
@pytest.mark.parametrize("there", ["source", "target"])
@pytest.mark.parametrize(
    ("named", "said"),
    [
        ("postgresql://me:p4ss@127.0.0.1:1/x", "port 1 failed: Connection refused"),
        ("postgresql://me:p4ss@/nowhere?host=CLUSTER", 'role "me" does not exist'),
        ("postgresql://parenting:p4ss@/nowhere?host=CLUSTER", 'database "nowhere" does not exist'),
    ],
)
def test_an_end_that_cannot_be_reached_is_told_with_the_reason_of_postgresql(
    settings: Settings, db: Database, tmp_path: Path, there: str, named: str, said: str
) -> None:
    db.close()
    url = named.replace("CLUSTER", str(cluster().folder)) if "CLUSTER" in named else named
    home, new = str(settings.data / "parenting.db"), str(tmp_path / "new.db")
    with pytest.raises(SetupError, match=f"cannot be reached: .*{said}. Nothing was copied") as refused:
        copy(*((url, new) if there == "source" else (home, url)), tmp_path)
    assert "p4ss" not in refused.value.message
