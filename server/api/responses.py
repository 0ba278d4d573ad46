"""The error responses of routes, in their one shape."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any

from pydantic import BaseModel

from parenting.server.errors import (
    BusyError,
    Conflict,
    DiskFullError,
    ElsewhereError,
    Forbidden,
    InvalidFieldsError,
    NotFound,
    ServerError,
    TooLargeError,
    TooManyOfOneError,
    UnauthenticatedError,
    UnknownHostError,
)

Replies = dict[int | str, dict[str, Any]]

ERRORS: dict[int, ServerError] = {
    400: UnknownHostError(),
    401: UnauthenticatedError(),
    403: Forbidden(),
    404: NotFound("There is no run 9."),
    409: Conflict("This run is stopped; its agent cannot be changed any more."),
    410: ElsewhereError(),
    413: TooLargeError(most=64 * 1024),
    422: InvalidFieldsError([("choice", "Input should be 'left', 'right', 'either' or 'neither'")]),
    429: TooManyOfOneError(),
    500: ServerError(),
    503: BusyError(),
    507: DiskFullError(),
}
"""An example of each status. 403 also means that the caller may not use a route, 429 that too many wrong
tokens came from its address, and 503 that too many live streams are open."""
ALWAYS = (400, 401, 403, 413, 422, 429, 500, 503)
ACTS = (507,)


class ErrorField(BaseModel):
    """A wrong field, and the error in it."""

    field: str
    message: str


class ErrorDetail(BaseModel):
    """An error: a code for programs, a sentence for people."""

    code: str
    message: str
    field: str | None = None
    fields: list[ErrorField] | None = None


class ErrorSchema(BaseModel):
    """The one shape of every error."""

    error: ErrorDetail


def read_responses(*errors: int) -> Replies:
    """Describe the errors of a route that changes nothing: the common ones, and its own."""
    return error_responses(*ALWAYS, *errors)


def write_responses(*errors: int) -> Replies:
    """Describe the errors of a route that writes: the common ones, and its own."""
    return error_responses(*ALWAYS, *ACTS, *errors)


def streams(media: str, description: str, *errors: int) -> Replies:
    """Describe a route whose reply is not JSON, and its errors."""
    refused = error_responses(*ALWAYS, *errors)
    for reply in refused.values():  # named, since FastAPI would put a model under the route's own media type
        reply["content"]["application/json"]["schema"] = {"$ref": "#/components/schemas/ErrorSchema"}
        del reply["model"]
    return {200: {"description": description, "content": {media: {}}}, **refused}


def error_responses(*errors: int) -> Replies:
    """Describe errors, each with an example."""
    return {
        status: {
            "model": ErrorSchema,
            "description": HTTPStatus(status).phrase,
            "content": {"application/json": {"example": ERRORS[status].body()}},
        }
        for status in sorted(errors)
    }
