"""What routes reply besides what they are asked for: the errors, in their one shape."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any

from pydantic import BaseModel

from parenting.server.errors import (
    BusyError,
    Conflict,
    DiskFullError,
    Forbidden,
    InvalidFieldsError,
    NotFound,
    ServerError,
    TooLargeError,
    UnknownHostError,
)

Replies = dict[int | str, dict[str, Any]]

ERRORS: dict[int, ServerError] = {
    400: UnknownHostError(),
    403: Forbidden(),
    404: NotFound("There is no run 9."),
    409: Conflict("Run 1 is stopped; nothing can be done to its agent any more."),
    413: TooLargeError(),
    422: InvalidFieldsError([("choice", "Input should be 'left', 'right', 'either' or 'neither'")]),
    500: ServerError(),
    503: BusyError(),
    507: DiskFullError(),
}
"""One of each status, as an example. 503 is also said when too many live streams are open."""
ALWAYS = (400, 413, 422, 500, 503)
ACTS = (403, 507)


class ErrorField(BaseModel):
    """One wrong field and what is wrong with it."""

    field: str
    message: str


class ErrorDetail(BaseModel):
    """What went wrong: a code for programs, a sentence for people."""

    code: str
    message: str
    field: str | None = None
    fields: list[ErrorField] | None = None


class ErrorSchema(BaseModel):
    """The one shape of every error."""

    error: ErrorDetail


def read_responses(*errors: int) -> Replies:
    """The replies of a route that changes nothing: the errors of all, and its own."""
    return error_responses(*ALWAYS, *errors)


def write_responses(*errors: int) -> Replies:
    """The replies of a verb."""
    return error_responses(*ALWAYS, *ACTS, *errors)


def streams(media: str, description: str, *errors: int) -> Replies:
    """The replies of a route that is no JSON, but for its errors."""
    refused = error_responses(*ALWAYS, *errors)
    for reply in refused.values():  # named, since FastAPI would put a model under the route's own media type
        reply["content"]["application/json"]["schema"] = {"$ref": "#/components/schemas/ErrorSchema"}
        del reply["model"]
    return {200: {"description": description, "content": {media: {}}}, **refused}


def error_responses(*errors: int) -> Replies:
    """Errors, each with an example."""
    return {
        status: {
            "model": ErrorSchema,
            "description": HTTPStatus(status).phrase,
            "content": {"application/json": {"example": ERRORS[status].body()}},
        }
        for status in sorted(errors)
    }
