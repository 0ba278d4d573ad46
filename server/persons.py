"""People who answer, under pseudonyms: one each, random, and the same in all of this database.

A browser, a program or a link answers under a name of its own (`client_id`), and several may be one person.
Exports hold the pseudonym and nothing else. Names and ids of other systems stand in a table apart.
"""

from __future__ import annotations

import secrets
from collections.abc import Collection
from datetime import datetime

from sqlalchemy import bindparam, insert, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from parenting.drawing.sentences import mark
from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.errors import Conflict, NotFound
from parenting.server.person_tables import Person, PersonClient, PersonName

ALPHABET = "23456789abcdefghjkmnpqrstuvwxyz"
"""Letters and digits that nobody takes for others."""
LENGTH = 9
AT_ONCE = 500
"""Names that one statement looks up."""
_KNOWN = (
    select(PersonClient.person_id, Person.deleting)
    .join(Person, Person.id == PersonClient.person_id)
    .where(PersonClient.client_id == bindparam("client_id"))
)


def new_pseudonym() -> str:
    """Draw a pseudonym from the system's source of randomness."""
    return "p" + "".join(secrets.choice(ALPHABET) for _ in range(LENGTH))


def person_of(session: Session, client_id: str, now: datetime) -> int:
    """Return the person who answers under a name, a new one where it is new.

    Raises:
        Conflict: this person's data are being deleted.
    """
    known = session.execute(_KNOWN, {"client_id": client_id}).one_or_none()
    if known is not None:
        if known.deleting is not None:
            raise Conflict(mark("What you said here is being deleted, so nothing more is stored of you."))
        return int(known.person_id)
    try:
        with session.begin_nested():
            made = insert(Person).values(pseudonym=new_pseudonym(), created=now).returning(Person.id)
            person_id = session.execute(made).scalar_one()
            session.execute(insert(PersonClient).values(client_id=client_id, person_id=person_id))
    except IntegrityError:  # another process has met the same name at this moment
        return int(session.execute(_KNOWN, {"client_id": client_id}).scalar_one())
    return person_id


def pseudonyms(db: Database, client_ids: Collection[str]) -> dict[str, str]:
    """Return the pseudonym of each name that is a person's."""
    wanted, found = sorted(set(client_ids)), {}
    rows = select(PersonClient.client_id, Person.pseudonym).join(Person, Person.id == PersonClient.person_id)
    for first in range(0, len(wanted), AT_ONCE):
        part = rows.where(PersonClient.client_id.in_(wanted[first : first + AT_ONCE]))
        with db.read() as session:
            found.update({row.client_id: row.pseudonym for row in session.execute(part)})
    return {name: told for name, told in found.items() if isinstance(name, str) and isinstance(told, str)}


def find_person(session: Session, pseudonym: str) -> Person:
    """Return a person by their pseudonym.

    Raises:
        NotFound: there is none.
    """
    found = session.scalars(select(Person).where(Person.pseudonym == pseudonym)).one_or_none()
    if found is None:
        raise NotFound(mark("There is no person {person}."), person=pseudonym)
    return found


def clients_of(session: Session, person_id: int) -> list[str]:
    """Return the names under which a person answers."""
    return list(
        session.scalars(select(PersonClient.client_id).where(PersonClient.person_id == person_id)).all()
    )


def name_person(db: Database, pseudonym: str, name: str | None, external_id: str | None) -> None:
    """Keep what a researcher knows a person by; None removes it. It stands apart from all that they said.

    Raises:
        NotFound: there is no such person.
    """
    with db.write() as session:
        person = find_person(session, pseudonym)
        row = session.get(PersonName, person.id)
        if row is None:
            row = PersonName(person_id=person.id)
            session.add(row)
        row.name, row.external_id = name, external_id
        if sound(row, "name") is None and sound(row, "external_id") is None:
            session.expunge(row) if row in session.new else session.delete(row)


def join(session: Session, client_id: str, person_id: int) -> None:
    """Have a name be a person's, so that several browsers or a link count as one person.

    A name of another person becomes this one's, with all that was said under it.
    """
    row = session.get(PersonClient, client_id)
    if row is None:
        session.add(PersonClient(client_id=client_id, person_id=person_id))
    elif row.person_id != person_id:
        row.person_id = person_id
