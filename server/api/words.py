"""What requests may say: ids, client ids, ticks, choices; and the errors that every route may give."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import Path, Query
from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from server.starting import LARGEST_INT

RunId = Annotated[int, Path(ge=1, le=LARGEST_INT)]
QueryId = Annotated[int, Path(ge=1, le=LARGEST_INT)]
After = Annotated[int, Query(ge=-1, le=LARGEST_INT, description="Only ticks after this one.")]
ClientId = Annotated[str, StringConstraints(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9._:-]+$")]
Choice = Literal["left", "right", "either", "neither"]


class ErrorField(BaseModel):
    """One wrong field and what is wrong with it."""

    field: str
    message: str


class ErrorWords(BaseModel):
    """What went wrong: a code for programs, a sentence for people."""

    code: str
    message: str
    field: str | None = None
    fields: list[ErrorField] | None = None


class ErrorShape(BaseModel):
    """The one shape of every error."""

    error: ErrorWords


class Strict(BaseModel):
    """A body that takes its own fields and no others."""

    model_config = ConfigDict(strict=True, extra="forbid")


class LeaseBody(Strict):
    """Who asks for a question."""

    client_id: ClientId = Field(description="The browser's own id, the same in all its tabs.")


class AnswerBody(Strict):
    """What the parent said, and who."""

    choice: Choice
    client_id: ClientId


def errors(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The errors of a route, for the description of the API."""
    return {status: {"model": ErrorShape} for status in (400, *statuses, 422, 503)}
