"""Identity: a database, a run and a question have ids that nobody can guess and that are given once."""

import re
from pathlib import Path

import pytest
from sqlalchemy import delete, func, insert, select, text
from sqlalchemy.exc import IntegrityError

from parenting.server.db import Database
from parenting.server.identity import database_id, renew
from parenting.server.migrate import downgrade, upgrade
from parenting.server.new_run import NewRun, start
from parenting.server.public_ids import ALPHABET, PATTERN, public_id
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim, claim
from parenting.server.settings import Settings
from parenting.server.tables import Identity, Query, Run
from tests.database import migrated
from tests.server.conftest import CLIPS, Clock

UUID4 = r"[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}"

MANY = 2001
"""More questions than the migration names at a time."""


def public_ids(db: Database) -> list[str]:
    """The public ids of all runs and questions."""
    with db.read() as session:
        return [*session.scalars(select(Run.public_id)), *session.scalars(select(Query.public_id))]


def start_one(db: Database) -> Run:
    return start(db, NewRun(world="unsafe-exploration"))


def ask(db: Database, mine: Claim, tick: int) -> int:
    return post_query(db, mine, tick, "preference", 1, CLIPS)


def test_public_ids_have_128_random_bits_and_are_never_equal() -> None:
    drawn = [public_id() for _ in range(5000)]
    assert all(re.fullmatch(PATTERN, one) for one in drawn)
    assert len(set(drawn)) == len(drawn)
    alphabet = set(ALPHABET)
    assert len(alphabet) ** 22 > 2**128
    for place in range(22):  # every place is free: a letter that is missing there has a chance of 1e-36
        assert {one[place] for one in drawn} == alphabet


def test_ids_do_not_follow_from_numbers(db: Database, clock: Clock, tmp_path: Path) -> None:
    other = migrated(Settings(data=tmp_path / "other", database_url=None), clock)
    for one in (db, other):
        start_one(one)
        (mine,) = claim(one, "worker-1")
        ask(one, mine, 1)
    assert len({*public_ids(db), *public_ids(other)}) == 4
    other.close()


@pytest.mark.slow
def test_rows_from_before_get_ids_of_their_own(db: Database, mine: Claim) -> None:
    row = {"run_id": mine.run_id, "kind": "preference", "maturity": 1, "clips": CLIPS, "posted": db.clock()}
    with db.write() as session:
        session.execute(insert(Query), [{**row, "tick": tick} for tick in range(MANY)])
    before = (database_id(db), *public_ids(db))
    downgrade(db, "0004")
    upgrade(db)
    after = (database_id(db), *public_ids(db))
    assert re.fullmatch(UUID4, after[0])
    assert all(re.fullmatch(PATTERN, one) for one in after[1:])
    assert len(after) == 1 + 1 + MANY
    assert len({*before, *after}) == 2 * len(after), "drawn afresh: nothing follows from the rows"


@pytest.mark.parametrize("table", [Run, Query])
def test_public_ids_are_unique_by_the_database(
    db: Database, mine: Claim, guidance: int, table: type[Run] | type[Query]
) -> None:
    start_one(db)
    ask(db, mine, 6)
    with pytest.raises(IntegrityError, match="public_id"), db.write() as session:
        session.execute(text(f"UPDATE {table.__tablename__} SET public_id = 'same'"))


def test_deleted_numbers_are_never_given_again(db: Database, mine: Claim) -> None:
    numbers = [ask(db, mine, tick) for tick in range(3)]
    with db.write() as session:
        session.execute(delete(Query).where(Query.id >= numbers[1]))
    assert ask(db, mine, 9) == numbers[-1] + 1
    runs = [start_one(db).id for _ in range(3)]
    with db.write() as session:
        session.execute(delete(Run).where(Run.id == runs[2]))
        session.execute(delete(Run).where(Run.id == runs[1]))  # a smaller one, later
    assert start_one(db).id == runs[-1] + 1


def test_deleted_public_ids_lead_nowhere(db: Database, mine: Claim) -> None:
    gone = start_one(db)
    with db.write() as session:
        session.execute(delete(Run).where(Run.id == gone.id))
    fresh = [start_one(db).public_id for _ in range(20)]
    assert gone.public_id not in fresh


def test_database_has_one_identity(db: Database) -> None:
    assert re.fullmatch(UUID4, database_id(db))
    with pytest.raises(IntegrityError), db.write() as session:
        session.add(Identity(id=2, uuid="another", since=db.clock()))
    with db.read() as session:
        assert session.scalar(select(func.count()).select_from(Identity)) == 1


def test_renewed_copy_is_another_database_with_the_same_questions(
    db: Database, mine: Claim, guidance: int, clock: Clock
) -> None:
    before, names = database_id(db), public_ids(db)
    clock.pass_seconds(10)
    after = renew(db)
    assert after == database_id(db) != before
    assert public_ids(db) == names
    with db.read() as session:
        row = session.scalars(select(Identity)).one()
    assert (row.copied_from, row.since) == (before, clock.now)
