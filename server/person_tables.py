"""The tables of people who answer: pseudonyms, the browsers they use, and, apart from both, their names."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import ForeignKey, Index
from sqlalchemy.orm import Mapped, mapped_column

from parenting.server.table_root import Table


class Person(Table):
    """A person who answers, by a random pseudonym that is the same in all of this database."""

    __tablename__ = "person"

    id: Mapped[int] = mapped_column(primary_key=True)
    pseudonym: Mapped[str] = mapped_column(unique=True)
    created: Mapped[datetime]  # with the first answer
    deleting: Mapped[datetime | None]  # when the deletion of their data was confirmed (`server.erasure`)


class PersonClient(Table):
    """A name under which a person answers: of a browser (its cookie), of a program or of a link."""

    __tablename__ = "person_client"
    __table_args__ = (Index(None, "person_id"),)

    client_id: Mapped[str] = mapped_column(primary_key=True)
    person_id: Mapped[int] = mapped_column(ForeignKey("person.id"))


class PersonName(Table):
    """Names that a researcher knows a person by. No export holds them."""

    __tablename__ = "person_name"

    person_id: Mapped[int] = mapped_column(ForeignKey("person.id"), primary_key=True, autoincrement=False)
    name: Mapped[str | None]
    external_id: Mapped[str | None]  # of a study, a panel or the like
