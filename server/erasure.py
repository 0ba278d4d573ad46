"""Delete one person's data: what they said, their names, the browsers by which they are known.

An agent that they alone raised goes as a whole (`server.deletion`). In one that others raised too, their
answers leave X, by a process that has torch (`server.erasing`), and all that they wrote is overwritten: the
chain keeps hashes, which say nothing without their salts. `begin` marks the person; whoever is killed then
leaves the mark, with which a worker or the same command goes on.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from sqlalchemy import delete, exists, func, select, update
from sqlalchemy.orm import Session

from parenting.server import deletion
from parenting.server.audit.recording import record
from parenting.server.audit.table import Kind
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.person_tables import Person, PersonClient, PersonName
from parenting.server.persons import clients_of, find_person, new_pseudonym
from parenting.server.store.refusals import translated
from parenting.server.store.relay import announce
from parenting.server.store.scrub import scrub
from parenting.server.tables import Answer, Query, Run, Table

ERASED = "erased"
"""The giver of an answer that was erased, as far as its row says."""
_LEASE = ("leased", "leased_until", "leased_by", "lease_epoch", "lease_begin", "lease_end")


@dataclass(frozen=True)
class Plan:
    """The effects of a deletion, before it."""

    pseudonym: str
    answers: int
    alone: Sequence[int] = ()  # runs that they alone answered: deleted
    shared: Sequence[int] = ()  # runs that others answered too: their answers leave X
    began_with: Sequence[int] = field(default_factory=tuple)  # other runs that began with answers of these


def plan(db: Database, pseudonym: str) -> Plan:
    """Return what the deletion of a person will do.

    Raises:
        NotFound: there is no such person.
    """
    with db.read() as session:
        person = find_person(session, pseudonym)
        clients = clients_of(session, person.id)
        return _plan(session, pseudonym, clients)


def _plan(session: Session, pseudonym: str, clients: Sequence[str]) -> Plan:
    mine = Answer.client_id.in_(clients)
    counted = session.execute(
        select(Answer.run_id, func.count()).where(mine).group_by(Answer.run_id).order_by(Answer.run_id)
    ).all()
    runs = [run_id for run_id, _ in counted]
    others = (
        select(Answer.run_id).where(Answer.run_id.in_(runs), ~mine, Answer.client_id != ERASED).distinct()
    )
    shared = sorted(session.scalars(others).all())
    names = session.scalars(select(Run.public_id).where(Run.id.in_(runs))).all()
    return Plan(
        pseudonym,
        sum(count for _, count in counted),
        [one for one in runs if one not in shared],
        shared,
        _began_with(session, names),
    )


def _began_with(session: Session, public_ids: Sequence[str]) -> list[int]:
    """Return the runs that began with answers of some runs: their X holds copies without a name."""
    found = []
    for row in session.execute(select(Run.id, Run.origin).where(Run.origin.is_not(None))):
        answers = row.origin.get("answers") if isinstance(row.origin, dict) else None
        if isinstance(answers, dict) and answers.get("run") in public_ids:
            found.append(row.id)
    return found


def begin(db: Database, pseudonym: str) -> None:
    """Mark a person: from now on nothing of theirs is stored any more. A second call changes nothing.

    Raises:
        NotFound: there is no such person.
    """
    with db.write() as session:
        person = find_person(session, pseudonym)
        if person.deleting is None:
            person.deleting = db.clock()
            _enter(db, session, person.id)
        announce(session, "worker")


def _enter(db: Database, session: Session, person_id: int) -> None:
    """Add to the audit log which agents lose answers; the person is not named: nothing of them stays."""
    record(db, session, Kind.DELETION, "a person's data")
    for run_id in _plan(session, "", clients_of(session, person_id)).shared:
        record(db, session, Kind.DELETION, "a person's answers", session.get(Run, run_id))


def under_way(db: Database) -> Sequence[Person]:
    """Return the people whose deletion is not over."""
    with db.read() as session:
        return session.scalars(select(Person).where(Person.deleting.is_not(None)).order_by(Person.id)).all()


def nameless(db: Database) -> Sequence[int]:
    """Return the people of whom nothing is stored any more, but whose old rows the file may hold yet."""
    named = exists().where(PersonClient.person_id == Person.id)
    with db.read() as session:
        return session.scalars(select(Person.id).where(Person.deleting.is_not(None), ~named)).all()


@dataclass(frozen=True)
class Left:
    """The rest of the work for a person who is marked."""

    person: int
    clients: Sequence[str]
    plan: Plan


def left_of(db: Database, person_id: int) -> Left:
    """Return what is left to do; nothing where another process was faster."""
    with db.read() as session:
        clients = clients_of(session, person_id)
        return Left(person_id, clients, _plan(session, "", clients))


def go_on_without_torch(db: Database, person_id: int) -> Left:
    """Delete the runs that a person alone raised; return what is left after that."""
    left = left_of(db, person_id)
    for run_id in left.plan.alone:
        with suppress(NotFound):  # another process was faster
            deletion.delete_run(db, run_id)
    return left_of(db, person_id) if left.plan.alone else left


def finish(db: Database, person_id: int) -> bool:
    """Delete a person's names and marks, then overwrite what the store's file holds of them.

    Returns:
        Whether the file was overwritten; if not, another program reads it, and a worker tries again.
    """
    with db.write() as session:
        clients = clients_of(session, person_id)
        theirs = select(Query.run_id).where(Query.leased_by.in_(clients))
        session.execute(select(Run.id).where(Run.id.in_(theirs)).order_by(Run.id).with_for_update()).all()
        for table in reversed(Table.metadata.sorted_tables):
            if "client_id" in table.c and table.name not in ("answer", "person_client"):
                session.execute(delete(table).where(table.c.client_id.in_(clients)))
        session.execute(update(Query).where(Query.leased_by.in_(clients)).values(dict.fromkeys(_LEASE)))
        session.execute(delete(PersonName).where(PersonName.person_id == person_id))
        session.execute(delete(PersonClient).where(PersonClient.person_id == person_id))
        # The row stays until the file is overwritten, under a pseudonym that says nothing.
        rest = update(Person).where(Person.id == person_id, Person.deleting.is_not(None))
        session.execute(rest.values(pseudonym=new_pseudonym()))
    with translated():
        emptied = scrub(db.engine)
    if not emptied:
        return False
    with db.write() as session:
        gone = delete(Person).where(Person.id == person_id, Person.deleting.is_not(None))
        session.execute(gone.where(~exists().where(PersonClient.person_id == person_id)))
    return True
