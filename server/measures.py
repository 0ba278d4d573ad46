"""Measures of an answer, as the page took them: when it was seen, how fast, on which screen, by which means.

They are stored in one short text, the values in the order of `Measured` between commas; what was not measured
is left empty. Times of the browser's wall clock are stored as it had them, right or wrong: beside them stands
`received`, by the server's.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints
from sqlalchemy import Dialect, Text
from sqlalchemy.types import TypeEngine

from parenting.server.columns import Checked
from parenting.server.whole import WHOLE

LONGEST_MS = 10**10
"""About four months, for which nobody looks at a question and no browser keeps an answer."""
LATEST_MS = 253_402_300_799_999
"""The end of the year 9999, in milliseconds since 1970."""
Moment = Annotated[int, Field(ge=0, le=LATEST_MS), WHOLE]
Span = Annotated[int, Field(ge=0, le=LONGEST_MS), WHOLE]
Pixels = Annotated[int, Field(ge=0, le=100_000), WHOLE]
Layout = Literal["one", "two", "turns"]
Sides = Literal["left-right", "right-left"]
Input = Literal["key", "click", "touch", "form"]
Wording = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{8}$")]


class Measured(BaseModel):
    """The measures of one answer; null: not measured."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)

    shown: Moment | None = Field(
        None, description="When the question was painted: ms since 1970 by the browser's wall clock."
    )
    reacted: Span | None = Field(
        None, description="ms from then to the first pointer's move or press on the question, or key."
    )
    answered: Span | None = Field(
        None, description="ms from then to the choice: the time of reading and deciding, online or not."
    )
    queued: Span | None = Field(
        None, description="ms from the choice until the browser sent it, by its wall clock: longer offline."
    )
    away: Span | None = Field(
        None, description="ms for which the tab was hidden meanwhile; 0: it was not left."
    )
    layout: Layout | None = Field(
        None, description="one or two boards, or two clips that take turns on a small screen."
    )
    sides: Sides | None = Field(
        None, description="The candidates as they stood, from the left or from the top."
    )
    width: Pixels | None = Field(None, description="The width of the viewport, in CSS pixels.")
    height: Pixels | None = Field(None, description="Its height.")
    input: Input | None = Field(
        None, description="What the choice was made with; form: the page's form was sent without its script."
    )
    wording: Wording | None = Field(
        None, description="The version of the sentences that were shown: a hash of them in their language."
    )


FIELDS = tuple(Measured.model_fields)
WORDS: dict[str, dict[str, str]] = {
    "layout": {"one": "1", "two": "2", "turns": "t"},
    "sides": {"left-right": "l", "right-left": "r"},
    "input": {"key": "k", "click": "c", "touch": "t", "form": "f"},
}
"""The letters that stand for words."""
LETTERS = {name: {letter: word for word, letter in words.items()} for name, words in WORDS.items()}
AS_TEXT = ("wording",)
BY_FORM: dict[str, Any] = Measured(input="form").model_dump()
"""The measures of an answer that came by the page's form without its script."""


def shorten(measured: dict[str, Any]) -> str:
    """Return measures as they are stored.

    Raises:
        KeyError: a value is none that its field can have.
    """
    return ",".join(_short(name, measured.get(name)) for name in FIELDS)


def whole(stored: str) -> dict[str, Any]:
    """Return stored measures, by name.

    Raises:
        ValueError: the text is none of `shorten`.
        KeyError: a letter stands for nothing.
    """
    parts = zip(FIELDS, stored.split(","), strict=True)
    found = {name: None if part == "" else _value(name, part) for name, part in parts}
    return Measured.model_validate(found).model_dump()


def _short(name: str, value: Any) -> str:
    if value is None:
        return ""
    return WORDS[name][value] if name in WORDS else str(value)


def _value(name: str, part: str) -> int | str:
    if name in LETTERS:
        return LETTERS[name][part]
    return part if name in AS_TEXT else int(part)


class Measures(Checked[dict[str, Any]]):
    """The measures of an answer, in one short text."""

    cache_ok = True
    impl: TypeEngine[Any] | type[TypeEngine[Any]] = Text
    kind, noun = dict, "measures of an answer"

    def process_bind_param(self, value: Any, dialect: Dialect) -> Any:
        """To the short text."""
        value = super().process_bind_param(value, dialect)
        return None if value is None else shorten(value)

    def process_result_value(self, value: Any, dialect: Dialect) -> Any:
        """Back to the measures."""
        return None if value is None else whole(value)
