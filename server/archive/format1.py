"""Read one table of answers (format 1) as the record of a run, with the run's log beside it. No torch.

Its lines have the questions that were answered and the ticks at which their answers were heard. The level's
text, config, seed and the questions that nobody answered are not in it; `format1_record` finds these again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from parenting.agent.events import Event
from parenting.envs.level_bytes import encoding_of
from parenting.server.archive.import_rules import first_of
from parenting.server.errors import SetupError
from parenting.server.notes import AGENT_KINDS
from parenting.weights.answers_file import MOST_BYTES

MOST = 10**9
"""The largest number of ticks, as of a training, and of what is counted."""


def _in_utc(time: datetime) -> datetime:
    try:
        return time.replace(tzinfo=time.tzinfo or UTC).astimezone(UTC)
    except OverflowError:
        raise ValueError("there is no such time in UTC") from None


Tick = Annotated[int, Field(ge=0, le=MOST)]
Count = Annotated[int, Field(ge=0, le=MOST)]
Time = Annotated[datetime, AfterValidator(_in_utc)]
EVENT: TypeAdapter[Event] = TypeAdapter(Event)


class _Read(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class Policy(_Read):
    """The policy that asked; null in lines of versions that did not keep it."""

    stage: int | None = None
    gradient_steps: int | None = None


class Line(_Read):
    """An answer with its question. What version 0.1.0 did not write has a default."""

    number: Annotated[int, Field(ge=1)]
    world: str
    level: str
    kind: Literal["guidance", "preference"]
    maturity: int
    votes: int = 0
    tick: Tick
    applied_tick: Tick | None
    policy: Policy
    left: dict[str, Any]
    right: dict[str, Any]
    choice: Literal["left", "right", "either", "neither", "skip"]
    parent: Literal["human", "scripted"]
    asked: Time
    received: Time
    standing: bool
    supersedes: int | None
    leased: Time | None = None
    replays: Count | None = None
    script: str | None = None
    guidance_layout: str = "one"
    practice: str = "offered"
    words: str = "plain"
    remarks: bool = True
    run: int
    run_public_id: str | None = None
    query_public_id: str | None = None
    database: str | None = None


class Logged(_Read):
    """An operator's event that the agent heard, or is to hear."""

    kind: str
    applied_tick: Tick | None
    created: Time
    payload: dict[str, Any]

    @property
    def event(self) -> Event:
        """The event as the agent hears it."""
        return EVENT.validate_python({"kind": self.kind, **self.payload})


class Table(NamedTuple):
    """The answers of a run by their numbers, and its operator's events in their order."""

    lines: Sequence[Line]
    events: Sequence[Logged]
    sha256: str  # of the file of answers

    @property
    def last(self) -> int:
        """The last tick that is known of."""
        ticks = [tick for line in self.lines for tick in (line.tick, line.applied_tick)]
        ticks += [event.applied_tick for event in self.events]
        return max(tick for tick in ticks if tick is not None)


def read_table(answers: Path, log: Path | None = None) -> Table:
    """Read what `parenting export RUN -o FILE.jsonl` has written and, beside it, `--of events`.

    Raises:
        SetupError: a line cannot be read, was damaged, or does not fit the others.
    """
    blob = _bytes(answers)
    lines = [_line(answers, number, row) for number, row in _rows(answers, blob)]
    events = () if log is None else [_event(log, *row) for row in _rows(log, _bytes(log))]
    if not lines:
        raise SetupError(f"{answers} has no answers, so there is no run to import.")
    for number, wrong in _misfits(lines):
        raise SetupError(f"{answers}: line {number} {wrong}. Nothing was imported.")
    heard = [one for one in events if one is not None]
    return Table(lines, heard, hashlib.sha256(blob).hexdigest())


def _bytes(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            blob = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise SetupError(f"{path} cannot be read: {error.strerror}.") from None
    if len(blob) > MOST_BYTES:
        raise SetupError(f"{path} has more than {MOST_BYTES} bytes, which are read at most.")
    if (encoding := encoding_of(blob)) != "utf-8":
        raise SetupError(f"{path} is {encoding[:6].upper()}, and a table is read in UTF-8. Save it as UTF-8.")
    return blob


def _rows(path: Path, blob: bytes) -> Iterator[tuple[int, Mapping[str, Any]]]:
    for number, line in enumerate(blob.rstrip().splitlines(), start=1):
        try:
            row = json.loads(line)
        except (ValueError, RecursionError):
            row = None
        if not isinstance(row, dict):
            raise SetupError(f"{path}: line {number} is not a JSON object, as `parenting export` writes it.")
        if "damaged" in row:
            raise SetupError(f"{path}: line {number} was damaged in its database: {row['damaged']}.")
        yield number, row


def _line(path: Path, number: int, row: Mapping[str, Any]) -> Line:
    try:
        return Line.model_validate(row)
    except ValidationError as error:
        raise SetupError(f"{path}: line {number}: {first_of(error)}. Nothing was imported.") from None


def _event(path: Path, number: int, row: Mapping[str, Any]) -> Logged | None:
    """Return an event; None for a note, which the agent does not hear."""
    try:
        event = Logged.model_validate(row)
        if event.kind not in AGENT_KINDS:
            return None
        EVENT.validate_python({"kind": event.kind, **event.payload})
        return event
    except ValidationError as error:
        raise SetupError(f"{path}: line {number}: {first_of(error)}. Nothing was imported.") from None


def _misfits(lines: Sequence[Line]) -> Iterator[tuple[int, str]]:
    """Yield what contradicts an earlier line, by its number."""
    heard = set[int]()
    for number, line in enumerate(lines, start=1):
        if line.number != number:
            yield number, f"has answer {line.number}: it is not the whole table of one run"
        if (line.run, line.world, line.level) != (lines[0].run, lines[0].world, lines[0].level):
            yield number, "is of another run than the first line"
        if line.applied_tick is not None:
            if line.applied_tick <= line.tick or line.applied_tick in heard:
                yield number, "was heard before its question was asked, or with another answer"
            heard.add(line.applied_tick)
        if line.supersedes is not None:
            earlier = lines[line.supersedes - 1] if 0 < line.supersedes < number else None
            if earlier is None or earlier.tick != line.tick:
                yield number, "supersedes no earlier answer to its question"
