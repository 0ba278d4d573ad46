"""Exports of answers that a run may begin with, read by line and checked against its world. No torch."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from parenting.envs.level_bytes import encoding_of

Whole = Annotated[int, Field(ge=-1, le=1000)]
MOST_BYTES = 200_000_000
"""A larger export is refused."""


class AnswersFileError(ValueError):
    """The file is not an export of answers; the sentence names the line."""


class _Read(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class _Frame(_Read):
    ground: list[str]
    observed: list[str]
    agent: tuple[Whole, Whole]
    box: tuple[Whole, Whole] | None


class _Clip(_Read):
    actions: Annotated[list[Literal["up", "down", "left", "right"]], Field(min_length=1, max_length=16)]
    length: int
    frames: list[_Frame]


class Heard(_Read):
    """A line of an export, as far as X needs it."""

    world: str
    kind: Literal["guidance", "preference"]
    maturity: Annotated[int, Field(ge=1, le=16)]
    votes: Annotated[int, Field(ge=0, le=100)] = 0
    left: _Clip
    right: _Clip
    choice: Literal["left", "right", "either", "neither"]


class Answers(NamedTuple):
    """The answers of an export that stand, in its order, and the run that it is of."""

    rows: Sequence[Heard]
    run: str | None  # the public id; None: the export of version 0.1.0 has none
    database: str | None


def read_answers(blob: bytes) -> Answers:
    """Read an export; what was superseded, skipped or damaged is left out.

    Raises:
        AnswersFileError: a line is not one of an export, or no answer stands.
    """
    if len(blob) > MOST_BYTES:
        raise AnswersFileError(f"it has {len(blob)} bytes, and {MOST_BYTES} are read at most")
    if (encoding := encoding_of(blob)) != "utf-8":
        raise AnswersFileError(
            f"it is {encoding[:6].upper()}, and a table is read in UTF-8; save it as UTF-8"
        )
    found, source = list[Heard](), dict[str, Any]()
    for number, line in enumerate(blob.splitlines(), start=1):
        if line.strip():
            row = _line(number, line)
            source = source or row
            if row.get("standing") and row.get("choice") not in ("skip", None) and "damaged" not in row:
                found.append(_heard(number, row))
    if not found:
        raise AnswersFileError("no answer stands in it")
    return Answers(found, source.get("run_public_id"), source.get("database"))


def _line(number: int, line: bytes) -> dict[str, Any]:
    try:
        row = json.loads(line)
    except (ValueError, RecursionError):
        raise AnswersFileError(f"line {number} is not JSON; `parenting export` writes such files") from None
    if not isinstance(row, dict) or "choice" not in row:
        raise AnswersFileError(f"line {number} is not an answer; `parenting export` writes such files")
    return row


def _heard(number: int, row: Mapping[str, Any]) -> Heard:
    try:
        return Heard.model_validate(row)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise AnswersFileError(f"line {number}: {place}: {first['msg']}") from None


def misfits(
    answers: Answers, world: str, size: tuple[int, int], glyphs: str, stages: int
) -> list[tuple[str, str]]:
    """Return what of a run does not fit these answers, as (field, sentence).

    Args:
        answers: The answers.
        world: The run's world.
        size: Height and width of its level.
        glyphs: The glyphs of its world.
        stages: The longest clips of the run.
    """
    for number, row in enumerate(answers.rows, start=1):
        if row.world != world:
            return [("world", f"Answer {number} is of the world {row.world}, not of {world}.")]
        longest = max(row.left.length, row.right.length, row.maturity)
        if longest > stages:
            return [("config.stages", f"Answer {number} has clips of {longest} steps; the run has {stages}.")]
        for wrong in _wrong_frames(row, size, glyphs):
            return [("level", f"Answer {number} {wrong}")]
    return []


def _wrong_frames(row: Heard, size: tuple[int, int], glyphs: str) -> Iterator[str]:
    for clip in (row.left, row.right):
        if clip.length != len(clip.actions) or len(clip.frames) != clip.length + 1:
            yield "is damaged: its clips do not have a frame before and after every move."
        for frame in clip.frames:
            for board in (frame.ground, frame.observed):
                here = (len(board), len(board[0]) if board else 0)
                if here != size:
                    yield f"is on a board of {_by(here)}, and this level has {_by(size)}."
                if any(len(line) != here[1] or set(line) - set(glyphs) for line in board):
                    yield "is damaged: its board is not one of this world."
            if not (0 <= frame.agent[0] < size[0] and 0 <= frame.agent[1] < size[1]):
                yield "is damaged: its agent is not on the board."


def _by(size: tuple[int, int]) -> str:
    return f"{size[0]} x {size[1]}"


def pack_answers(answers: Answers) -> bytes:
    """Return the answers as few bytes, for a run's store."""
    return zlib.compress("\n".join(row.model_dump_json() for row in answers.rows).encode(), 9)


def unpack_answers(blob: bytes) -> list[Heard]:
    """Read what `pack_answers` wrote.

    Raises:
        AnswersFileError: the bytes are damaged.
    """
    try:
        return [Heard.model_validate_json(line) for line in zlib.decompress(blob).splitlines()]
    except (ValueError, zlib.error) as error:
        raise AnswersFileError(f"the stored answers are damaged ({type(error).__name__})") from None
