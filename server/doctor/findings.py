"""Findings of an examination."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from enum import StrEnum

from parenting.server.errors import BusyError, DamagedError, GoneError, ServerError
from parenting.server.store.refusals import refusal


class State(StrEnum):
    """The three grades of a finding."""

    OK = "ok"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True)
class Finding:
    """A part of an installation, its grade, the facts, and the remedy where one is needed."""

    name: str
    state: State
    said: str
    remedy: str | None = None

    def row(self) -> dict[str, str | None]:
        """Return this finding for JSON."""
        return {**asdict(self), "state": str(self.state)}


def ok(name: str, said: str) -> Finding:
    """Return a finding of something that is in order."""
    return Finding(name, State.OK, said)


def warning(name: str, said: str, remedy: str) -> Finding:
    """Return a finding that limits something or may become an error."""
    return Finding(name, State.WARNING, said, remedy)


def error(name: str, said: str, remedy: str) -> Finding:
    """Return a finding that keeps the program from working, or answers from being safe."""
    return Finding(name, State.ERROR, said, remedy)


PAGE = "docs/operations.md explains this message."
REMEDIES: dict[type[ServerError], str] = {
    BusyError: "End the program that holds the database or its connections, or try again.",
    GoneError: "Check that the database is there and runs, and the names in PARENTING_DATABASE_URL.",
    DamagedError: "Put a backup in its place: parenting restore FILE --replace",
}

Look = Callable[[], Iterable[Finding]]


def guarded(name: str, look: Look) -> Iterator[Finding]:
    """Yield the findings of one look; whatever it raises becomes a finding, too."""
    try:
        yield from look()
    except ServerError as refused:
        yield error(name, refused.message, _remedy(type(refused)))
    except Exception as failed:
        reason = " ".join(str(failed).split())[:300]
        said = f"It cannot be examined: {type(failed).__name__}: {reason}"
        yield error(name, said, _remedy(refusal(failed) or ServerError))


def _remedy(refused: type[ServerError]) -> str:
    return next((said for kind, said in REMEDIES.items() if issubclass(refused, kind)), PAGE)


def worst(findings: Iterable[Finding]) -> State:
    """Return the worst grade."""
    states = {one.state for one in findings}
    return next((state for state in (State.ERROR, State.WARNING) if state in states), State.OK)
