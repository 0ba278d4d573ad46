"""A parent that repeats what another one said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import TypeAdapter

from parenting.agent import query as queries
from parenting.agent.config import Config
from parenting.agent.events import Event
from parenting.agent.query import Choice, QueryKind
from parenting.agent.state import AgentState
from parenting.library.answer_log import describe
from parenting.library.parent import Parent, compose_answer
from parenting.library.question import Query, Question, choice_of
from parenting.library.result import TrainResult
from parenting.library.worlds import World

QUESTION = ("kind", "stage", "left", "right", "row", "column")
"""The columns of a record that say what was asked."""


_EVENTS: TypeAdapter[Event] = TypeAdapter(Event)


class ReplayError(ValueError):
    """The agents ask something else than was recorded: world, config or seed differ, or the program does."""


class ReplayParent(Parent):
    """Answers from a record, each at its tick; nobody is asked again.

    With the same world, config, seed and number of trials the same agents come of it.

    Args:
        recorded: A `TrainResult`, or its answers (records with `trial`, `asked`, `answered`, `choice` and
            what was asked).

    Raises:
        TypeError: `recorded` is neither.
        ReplayError: From `train` and `tick`: the agents ask something else than was recorded.

    Example:
        >>> import parenting as pt
        >>> first = pt.train("unsafe-exploration", seed=3, progress=False)
        >>> again = pt.train("unsafe-exploration", seed=3, parent=pt.ReplayParent(first), progress=False)
        >>> again.answers == first.answers
        True
    """

    def __init__(self, recorded: TrainResult | Sequence[Mapping[str, Any]]) -> None:
        rows: Any = recorded.answers if isinstance(recorded, TrainResult) else recorded
        if isinstance(rows, str) or not isinstance(rows, Sequence) or not all(map(_is_record, rows)):
            raise TypeError(
                f"recorded: {recorded!r} is neither a TrainResult nor its answers. A saved one is read by"
                " pt.load_result(folder)."
            )
        self.records = [row for row in rows if row["answered"] is not None]
        self.acts = recorded.events if isinstance(recorded, TrainResult) else []

    def begin(self, world: World, config: Config, trials: int) -> None:
        """Begin with the first record."""
        super().begin(world, config, trials)
        self._tick = 0
        self._by_answer = {(row["trial"], row["answered"]): row for row in self.records}
        self._by_question = {(row["trial"], row["asked"]): row for row in self.records}
        self._posted: dict[tuple[int, int], Query] = {}

    def events(self, state: AgentState) -> Sequence[Event]:
        """Return the operator's events that were applied before this tick."""
        tick = int(state.keys.tick[0]) + 1
        return [_event(act) for act in self.acts if act["tick"] == tick]

    def answer(self, question: Question) -> None:
        """Say nothing: answers come at their ticks, from the record."""

    def take(self, state: AgentState) -> queries.Answer:
        """Return the answers that were heard in this tick."""
        self._tick = int(state.keys.tick[0]) + 1
        heard: dict[int, tuple[Query, Choice]] = {}
        for trial in self.in_training:
            row = self._by_answer.get((trial, self._tick))
            if row is None:
                continue
            query = self._posted.get((trial, row["asked"]))
            if query is None:
                self._refuse(trial, row["asked"], row, "nothing")
            else:
                if row["choice"] != "skip":  # which may be answered later
                    del self._posted[trial, row["asked"]]
                heard[trial] = query, choice_of(row["choice"], "ReplayParent")
        return compose_answer(self, heard)

    def post(self, query: queries.Query) -> None:
        """Hold what is asked against the record."""
        known = Query.of(query, self.world)
        for trial in (query.kind != QueryKind.NONE).nonzero().flatten().tolist():
            row = self._by_question.get((trial, self._tick))
            if row is None:
                continue  # it was still open when the recording ended
            asked = dict(zip(QUESTION, describe(query, trial), strict=True))
            if asked != {name: row[name] for name in QUESTION}:
                self._refuse(trial, self._tick, row, f"{asked['left']!r} or {asked['right']!r}")
            self._posted[trial, self._tick] = known.row(trial)

    def _refuse(self, trial: int, tick: int, row: Mapping[str, Any], asked: str) -> None:
        raise ReplayError(
            f"At tick {tick} trial {trial} asks {asked}; recorded is {row['left']!r} or {row['right']!r}. "
            "Use the world, level, config, seed and number of trials of the recording."
        )


def _is_record(row: object) -> bool:
    wanted = {"trial", "asked", "answered", "choice", *QUESTION}
    return isinstance(row, Mapping) and wanted <= set(row)


def _event(act: Mapping[str, Any]) -> Event:
    """Return an event from its record; columns that belong to other kinds are empty."""
    return _EVENTS.validate_python({k: v for k, v in act.items() if k != "tick" and v is not None})
