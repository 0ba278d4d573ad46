"""The people who answered, by their pseudonyms, with what is known of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import func, select

from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.tables import Answer, Person, PersonClient, PersonName


@dataclass(frozen=True)
class Known:
    """A person, as a researcher sees them."""

    pseudonym: str
    name: str | None
    external_id: str | None
    answers: int
    runs: Sequence[int]
    first: datetime
    last: datetime | None
    deleting: bool


def persons(db: Database) -> list[Known]:
    """Return everybody who answered, the first of them first."""
    given = select(PersonClient.person_id, Answer.run_id, func.count(), func.max(Answer.received))
    given = given.join(Answer, Answer.client_id == PersonClient.client_id)
    with db.read() as session:
        people = session.execute(
            select(Person, PersonName)
            .outerjoin(PersonName, PersonName.person_id == Person.id)
            .order_by(Person.id)
        ).all()
        rows = session.execute(given.group_by(PersonClient.person_id, Answer.run_id)).all()
    return [_known(person, name, [row for row in rows if row[0] == person.id]) for person, name in people]


def _known(person: Person, name: PersonName | None, rows: Sequence[Sequence[object]]) -> Known:
    moments = [row[3] for row in rows if isinstance(row[3], datetime)]
    return Known(
        person.pseudonym,
        None if name is None else sound(name, "name"),
        None if name is None else sound(name, "external_id"),
        sum(row[2] for row in rows if isinstance(row[2], int)),
        sorted(row[1] for row in rows if isinstance(row[1], int)),
        person.created,
        max(moments, default=None),
        person.deleting is not None,
    )
