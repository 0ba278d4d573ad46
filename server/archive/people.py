"""The people of exports: pseudonyms alone. What lets a client change its answers stays in the database."""

from __future__ import annotations

import secrets
from collections.abc import Collection
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from parenting.server.damage import sound
from parenting.server.person_tables import Person, PersonClient
from parenting.server.tables import Answer


def pseudonyms(session: Session, clients: Collection[str]) -> dict[str, str]:
    """Return the pseudonym of each client that is a person's, in an open transaction."""
    rows = select(PersonClient.client_id, Person.pseudonym).join(Person, Person.id == PersonClient.person_id)
    return {row[0]: row[1] for row in session.execute(rows.where(PersonClient.client_id.in_(set(clients))))}


def client_of(session: Session, pseudonym: str, now: datetime) -> str:
    """Return a client of the person with this pseudonym; a new one where there is none."""
    person = session.scalars(select(Person).where(Person.pseudonym == pseudonym)).one_or_none()
    if person is None:
        person = Person(pseudonym=pseudonym, created=now)
        session.add(person)
        session.flush()
    known = select(PersonClient.client_id).where(PersonClient.person_id == person.id)
    client = session.scalar(known.order_by(PersonClient.client_id).limit(1))
    if client is None:
        client = f"imported-{secrets.token_hex(16)}"
        session.add(PersonClient(client_id=client, person_id=person.id))
        session.flush()
    return client


def erased(answer: Answer) -> bool:
    """Return whether the data of an answer's person were erased."""
    return sound(answer, "erased") is not None
