"""People who answer have a pseudonym each, from their first answer on; their names stand apart."""

from __future__ import annotations

import re

import pytest
from sqlalchemy import func, select

from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.migrate import downgrade, upgrade
from parenting.server.persons import join, name_person, person_of, pseudonyms
from parenting.server.queue.answers import answer
from parenting.server.queue.revisions import supersede
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.tables import Person, PersonName
from tests.server.conftest import CLIPS

PSEUDONYM = re.compile(r"p[2-9a-z]{9}")


@pytest.fixture
def said(db: Database, mine: Claim) -> None:
    """Two people answer, one of them twice; a script answers, too."""
    for tick, (name, parent) in enumerate(
        (("ann", "human"), ("bob", "human"), ("ann", "human"), ("script", "scripted"))
    ):
        answer(db, post_query(db, mine, tick, "preference", 1, CLIPS), "left", name, parent)
    supersede(db, 1, "right", "ann", "human")


def people(db: Database) -> int:
    with db.read() as session:
        return session.scalar(select(func.count()).select_from(Person)) or 0


@pytest.mark.usefixtures("said")
def test_each_has_one_and_scripts_have_none(db: Database) -> None:
    found = pseudonyms(db, ["ann", "bob", "script", "nobody"])
    assert set(found) == {"ann", "bob"}
    assert len(set(found.values())) == people(db) == 2
    assert all(PSEUDONYM.fullmatch(one) for one in found.values())
    assert pseudonyms(db, ["ann"]) == {"ann": found["ann"]}, "it stays the same"


@pytest.mark.usefixtures("said")
def test_names_stand_apart_and_can_go(db: Database) -> None:
    ann = pseudonyms(db, ["ann"])["ann"]
    name_person(db, ann, "Ann Example", None)
    name_person(db, ann, "Ann Example", "study-7")
    with db.read() as session:
        (row,) = session.scalars(select(PersonName)).all()
    assert (row.name, row.external_id) == ("Ann Example", "study-7")
    name_person(db, ann, None, None)
    with db.read() as session:
        assert session.scalars(select(PersonName)).all() == []
    with pytest.raises(NotFound, match="There is no person pzzz"):
        name_person(db, "pzzz", "x", None)


@pytest.mark.usefixtures("said")
def test_two_browsers_can_be_one_person(db: Database) -> None:
    ann = pseudonyms(db, ["ann"])["ann"]
    with db.write() as session:
        join(session, "her phone", person_of(session, "ann", db.clock()))
        join(session, "bob", person_of(session, "ann", db.clock()))
    assert set(pseudonyms(db, ["ann", "bob", "her phone"]).values()) == {ann}


@pytest.mark.usefixtures("said")
def test_those_of_before_get_theirs_by_the_migration(db: Database) -> None:
    before = pseudonyms(db, ["ann", "bob"])
    downgrade(db, "0026")
    upgrade(db)
    found = pseudonyms(db, ["ann", "bob", "script"])
    assert set(found) == {"ann", "bob"}
    assert not set(found.values()) & set(before.values()), "an older version keeps none"
    assert people(db) == 2
