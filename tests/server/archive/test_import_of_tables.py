"""One table of answers (format 1) is a run again, with the settings that it had and with no others."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select

from parenting.server import chain, runs
from parenting.server.archive.format1 import read_table
from parenting.server.archive.format1_import import import_table
from parenting.server.db import Database
from parenting.server.errors import SetupError
from parenting.server.export import lines
from parenting.server.exports import Part, exported
from parenting.server.new_run import NewRun, start
from parenting.server.operator_events import add_operator_event
from parenting.server.queue import answers, leases, revisions, skips, worker_side
from parenting.server.replay import differences
from parenting.server.runs import get_run
from parenting.server.session import RunSession
from parenting.server.settings import Settings
from parenting.server.tables import Answer, Person, Query, Run
from tests.database import migrated

SETTINGS: dict[str, Any] = {
    "world": "unsafe-exploration",
    "config": {"pretrain": False, "max_clip_length": 2},
}
pytestmark = pytest.mark.only("sqlite", "rows are written as a rollback writes them")


@pytest.fixture
def other(tmp_path: Path) -> Iterator[Database]:
    """An empty database elsewhere."""
    database = migrated(Settings(data=tmp_path / "other"))
    yield database
    database.close()


def session_of(db: Database, run: int) -> RunSession:
    (mine,) = (claim for claim in runs.claim(db, "worker", -1) if claim.run_id == run)
    session = RunSession(db, mine, get_run(db, run), lambda: None)
    session.save_if_due = lambda: None  # type: ignore[method-assign]
    return session


def settled(db: Database, session: RunSession) -> Query | None:
    """Live until somebody is asked; return what is asked."""
    run = session.claim.run_id
    while session.ready(seen := worker_side.watch(db, [run])[run]):
        session.tick(seen)
    return leases.lease(db, run, "tab")


def lived(db: Database) -> RunSession:
    """Live a run with a correction, a skip, events, and guidance that was withdrawn."""
    run = start(db, NewRun(**SETTINGS, seed=3)).id
    session = session_of(db, run)
    for place in range(12):
        query = settled(db, session)
        assert query is not None
        if place == 4:
            skips.skip(db, query.id, "tab")
        elif place == 6:
            add_operator_event(db, run, "end_episode", {})
        elif place == 8:
            add_operator_event(db, run, "mature", {})
            answers.answer(db, query.id, "right", "tab", "human")
        else:
            answers.answer(db, query.id, ("left", "right", "either")[place % 3], "tab", "human")
        if place == 5:
            add_operator_event(db, run, "change", {"name": "p_pref", "value": 0.4})
            revisions.supersede(db, 1, "right", "tab", "human")
    settled(db, session)
    session.save()
    return session


def written(db: Database, folder: Path) -> tuple[Path, Path]:
    """Write the table of answers of run 1, and its log."""
    table, log = folder / "run-1.jsonl", folder / "log.jsonl"
    table.write_text("".join(lines(db, 1)))
    log.write_text("".join(exported(db, 1, Part.EVENTS)))
    return table, log


def rows(db: Database, *but: str) -> list[dict[str, Any]]:
    """The table of run 1, without what an import makes itself and what only the worker of the origin knew."""
    names = {"query", "database", "reason", "effects", *but}
    return [{k: v for k, v in json.loads(line).items() if k not in names} for line in lines(db, 1)]


def test_it_is_the_same_run_again_and_goes_on_with_the_same_bits(
    db: Database, other: Database, tmp_path: Path
) -> None:
    first = lived(db)
    imported = import_table(other, read_table(*written(db, tmp_path)), NewRun(**SETTINGS, seed=3))
    was = get_run(db, 1)
    assert (imported.public_id, imported.answers) == (was.public_id, 12)
    assert rows(other) == rows(db)
    run = get_run(other, 1)
    assert (run.answers, run.retracted, run.skipped) == (was.answers, was.retracted, was.skipped)
    assert run.origin is not None
    assert (run.origin["imported"]["format"], run.origin["imported"]["run"]) == (1, was.public_id)
    assert chain.check(other, 1).problems == []
    again = session_of(other, 1)
    assert again.record_ends > 0
    settled(other, again)
    assert again.last_tick == first.last_tick
    assert differences(first.saved, again.saved) == []
    with db.read() as there, other.read() as here:
        told = (Query.tick, Query.kind, Query.status, Query.withdrawn_tick, Query.votes, Query.policy_steps)
        asked = [list(one.execute(select(*told).order_by(Query.tick))) for one in (there, here)]
        assert here.scalar(select(func.count()).select_from(Person)) == 1
    assert asked[0] == asked[1]
    assert {"withdrawn", "applied"} <= {row.status for row in asked[0]}


def change(file: Path, make: Callable[[list[dict[str, Any]]], Any]) -> None:
    told = [json.loads(line) for line in file.read_text().splitlines()]
    make(told)
    file.write_text("".join(json.dumps(row) + "\n" for row in told))


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The two files of a life, written once."""
    folder = tmp_path_factory.mktemp("table")
    database = migrated(Settings(data=folder / "data"))
    lived(database)
    found = written(database, folder)
    database.close()
    return found


DAMAGES: dict[str, tuple[Callable[[list[dict[str, Any]]], Any], str]] = {
    "an answer is missing": (lambda rows: rows.pop(2), "line 3 has answer 4"),
    "an answer was changed": (lambda rows: rows[1].update(choice="neither"), "the agent asks"),
    "a clip was changed": (
        lambda rows: rows[3]["left"]["frames"][0].update(agent=[1, 1]),
        "has another one there",
    ),
    "another policy asked": (lambda rows: rows[3]["policy"].update(gradient_steps=99), "has another one"),
    "heard before it was asked": (lambda rows: rows[3].update(applied_tick=1), "heard before its question"),
    "it supersedes what is not there": (lambda rows: rows[3].update(supersedes=9), "supersedes no earlier"),
    "of two runs": (lambda rows: rows[3].update(run=2), "is of another run"),
    "a board of another size": (lambda rows: rows[3]["left"]["frames"].append({}), "do not fit"),
    "damaged there": (lambda rows: rows[3].update(damaged="choice"), "was damaged in its database: choice"),
    "no answers": (lambda rows: rows.clear(), "has no answers"),
    "a time beyond all": (
        lambda rows: rows[3].update(received="9999-12-31T23:59:59-14:00"),
        "line 4: received: '9999-12-31T23:59:59-14:00': there is no such time in UTC",
    ),
    "replays beyond all": (
        lambda rows: rows[3].update(replays=2**70),
        f"line 4: replays: {2**70}: ",
    ),
    "a tick beyond all": (lambda rows: rows[-1].update(tick=2**53), "tick"),
    "a value is missing": (lambda rows: rows[3].pop("tick"), "line 4: tick: it is missing"),
    "a word for a number": (lambda rows: rows[3].update(tick="one"), "line 4: tick: 'one': "),
}


def test_a_table_in_another_encoding_is_refused_by_its_name(tmp_path: Path) -> None:
    file = tmp_path / "run-1.jsonl"
    file.write_text('{"number": 1}\n', encoding="utf-16")
    with pytest.raises(SetupError, match="is UTF-16, and a table is read in UTF-8"):
        read_table(file)


def test_blank_last_lines_are_no_answers(table: tuple[Path, Path], tmp_path: Path) -> None:
    file = tmp_path / "run-1.jsonl"
    file.write_bytes(table[0].read_bytes() + b"\n  \n")
    assert read_table(file).lines == read_table(table[0]).lines


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_table_that_was_changed_is_refused(
    table: tuple[Path, Path], other: Database, tmp_path: Path, damage: str
) -> None:
    make, told = DAMAGES[damage]
    file = tmp_path / "run-1.jsonl"
    file.write_bytes(table[0].read_bytes())
    change(file, make)
    with pytest.raises(SetupError) as refused:
        import_table(other, read_table(file, table[1]), NewRun(**SETTINGS, seed=3))
    assert told in refused.value.message
    assert counted(other) == [0, 0, 0]


@pytest.mark.parametrize("wrong", [{"seed": 4}, {"preset": "lax"}, {"log": None}])
def test_other_settings_are_refused(table: tuple[Path, Path], other: Database, wrong: dict[str, Any]) -> None:
    given = SETTINGS | {"seed": 3, "log": table[1]} | wrong
    log = given.pop("log")
    with pytest.raises(SetupError, match="With these settings the agent asks"):
        import_table(other, read_table(table[0], log), NewRun(**given))
    assert counted(other) == [0, 0, 0]


def counted(db: Database) -> list[int | None]:
    with db.read() as session:
        return [session.scalar(select(func.count()).select_from(one)) for one in (Run, Query, Answer)]
