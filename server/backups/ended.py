"""The ends of sessions and tokens in a copy: one that was ended since the backup would live on in it.

Nobody can say which were ended after the copy was made, so all of the copy are.
"""

from __future__ import annotations

from collections.abc import Container

TABLES = ("access_session", "access_token")


def statements(there: Container[str]) -> list[str]:
    """Return the SQL that ends all sessions and tokens, on either store, for the tables that there are."""
    return [
        f"UPDATE {table} SET revoked = created WHERE revoked IS NULL" for table in TABLES if table in there
    ]
