"""The roles, and the principal: who a request comes from, as far as this server knows."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

Way = Literal["session", "token", "key"]


class Role(StrEnum):
    """The roles, each with what it may do in `access.matrix`."""

    RESEARCHER = "researcher"
    PARENT = "parent"
    VIEWER = "viewer"


@dataclass(frozen=True, slots=True)
class Principal:
    """The caller of a request."""

    role: Role
    way: Way  # a browser's session, a program's token, or the key file of the data folder
    id: str  # the public id of the session or the token; "local" of the key file
    name: str | None = None  # what the researcher called it
    run: int | None = None  # the number of the only run that it reaches; None: all runs
    run_public_id: str | None = None
    client: str | None = None  # the name under which a parent answers; None: any

    @property
    def bound(self) -> bool:
        """True if it reaches its own offers and answers only: it answers under one name."""
        return self.client is not None

    @property
    def who(self) -> str:
        """A name for logs: the way, and the first characters of the id."""
        return f"{self.role} by {self.way} {self.id[:8]}"

    def reaches_run(self, name: str | int) -> bool:
        """Return whether a run, by its number or public id, is among those that it reaches."""
        return self.run is None or str(name) in (str(self.run), self.run_public_id)


LOCAL = Principal(Role.RESEARCHER, "key", "local", "the key file of the data folder")
"""A caller who can read the key file of the data folder: the user whose server this is."""
