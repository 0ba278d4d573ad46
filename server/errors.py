"""Every error that a user may meet, in one tree. The docstring of a class is its default message.

All have one JSON shape:

{"error": {"code": "invalid", "message": "...", "field": "seed", "fields": [{"field": ..., "message": ...}]}}

`field` and `fields` are present only where they apply.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy.exc import DontWrapMixin

from parenting.drawing.sentences import tr


class ServerError(Exception):
    """Something went wrong here; it was logged. Try again."""

    status = 500
    code = "internal"

    def __init__(self, message: str | None = None, *, field: str | None = None, **values: object) -> None:
        self.sentence = message or " ".join((type(self).__doc__ or "").split())
        self.values = values
        self.message = self.sentence.format(**values) if values else self.sentence
        self.field = field
        super().__init__(self.message)

    @property
    def told(self) -> str:
        """The message in the reader's language, where the catalogue has it."""
        return tr(self.sentence, **self.values)

    def body(self) -> dict[str, Any]:
        """Return the JSON shape of this error."""
        error: dict[str, Any] = {"code": self.code, "message": self.told}
        if self.field is not None:
            error["field"] = self.field
        return {"error": error}


class NotFound(ServerError):
    """This address does not exist."""

    status, code = 404, "not_found"


class Conflict(ServerError):
    """This contradicts what is already stored; nothing was changed."""

    status, code = 409, "conflict"


class ElsewhereError(ServerError):
    """This answer is meant for another database, run or question; it was not stored here. Keep it."""

    status, code = 410, "elsewhere"


class Forbidden(ServerError):
    """This request came from another site and was refused."""

    status, code = 403, "cross_site"


class UnauthenticatedError(ServerError):
    """This server does not know you.

    A browser enters by an address that `parenting access open` prints, or by the link that you were given.
    A program sends `Authorization: Bearer` and a token of `parenting access create token`; commands of
    Parenting send PARENTING_TOKEN, or use the key file of the data folder.
    """

    status, code = 401, "unauthenticated"


class NotAllowedError(ServerError):
    """You may not do this here."""

    status, code = 403, "not_allowed"


class UsedUpError(ServerError):
    """This address was used already, or is no longer valid. `parenting access open` prints a new one."""

    status, code = 410, "used_up"


class TooManyGuessesError(ServerError):
    """Too many wrong links or tokens came from this address. Wait a little, then try again."""

    status, code = 429, "guessing"

    def __init__(self, message: str | None = None, *, seconds: int = 1) -> None:
        """`seconds`: after so long the next one is taken."""
        self.seconds = seconds
        super().__init__(message)


class UnknownHostError(ServerError):
    """This server does not answer under this name."""

    status, code = 400, "unknown_host"


class PlainHttpError(ServerError):
    """This server takes https only. Use its address that begins with https://."""

    status, code = 403, "plain_http"


class ForwardedError(ServerError):
    """The proxy before this server does not say for whom it asks (X-Forwarded-For)."""

    status, code = 400, "forwarded"


class MethodNotAllowed(ServerError):
    """This address does not take that method."""

    status, code = 405, "method_not_allowed"


class TooManyStreamsError(ServerError):
    """Too many live streams are open. Close another page and reload this one."""

    status, code = 503, "too_many"


class TooManyRunsError(ServerError):
    """As many runs live as may. Stop some of them."""

    status, code = 409, "too_many_runs"


class TooManyOfOneError(ServerError):
    """This browser has too many live streams open. Close another one of its pages and reload this one."""

    status, code = 429, "too_many"


class NotReadyError(ServerError):
    """This server is not ready."""

    status, code = 503, "not_ready"


class StoppingError(ServerError):
    """This server is stopping. Send the same again once it is back."""

    status, code = 503, "stopping"


class TooLargeError(ServerError):
    """The body of this request is too large: it may have {most} bytes. Send less, or in several requests."""

    status, code = 413, "too_large"


class StoreError(ServerError):
    """The database cannot be used at the moment; nothing was stored. Send the same again."""

    status, code = 503, "store"

    def __init__(self, message: str | None = None, *, why: str | None = None) -> None:
        """`why`: what commands and logs say in its place, with names that are not for everybody's eyes."""
        super().__init__(message)
        self.message = why or self.message
        self.args = (self.message,)


class BusyError(StoreError):
    """The database was busy for five seconds; nothing was stored. Send the same again."""

    status, code = 503, "busy"


class RefusedError(StoreError):
    """The database cannot be written: it is read-only, its quota is used up or its disk has an error.

    Nothing was stored. Remove the cause and send the same again.
    """

    status, code = 507, "store_refused"


class DiskFullError(RefusedError):
    """The disk is full; nothing was stored. Free some space and send the same again."""

    status, code = 507, "disk_full"


class GoneError(StoreError):
    """The database cannot be reached; nothing was stored. Send the same again once it is back."""

    status, code = 503, "store_gone"


class DamagedError(StoreError):
    """The database is damaged; nothing was stored. Restore a backup: parenting restore."""

    status, code = 503, "store_damaged"


class DamagedRowError(ServerError, DontWrapMixin):
    """A stored row cannot be read. Only what needs this row fails; docs/operations.md names the remedies."""

    status, code = 500, "damaged"


class InvalidFieldsError(ServerError):
    """Some fields are wrong."""

    status, code = 422, "invalid"

    def __init__(self, fields: list[tuple[str, str]], message: str | None = None) -> None:
        self.fields = fields
        only = fields[0] if len(fields) == 1 else None
        super().__init__(
            message or (f"{only[0]}: {only[1]}" if only else None), field=only[0] if only else None
        )

    def body(self) -> dict[str, Any]:
        """Return the JSON shape, with one message for each field."""
        body = super().body()
        body["error"]["fields"] = [{"field": field, "message": message} for field, message in self.fields]
        return body


class SetupError(ServerError):
    """The server cannot start as it is set up. Commands print the message and exit with 2."""

    status, code = 500, "setup"


class LostClaimError(ServerError):
    """Another worker trains this run now; this one must release it without writing."""

    status, code = 409, "lost_claim"
