"""The questions and answers of every trial, as records that pandas and polars read directly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.agent.events import Event
from parenting.agent.query import Answer, Choice, Query, QueryKind
from parenting.drawing.query_tensors import ACTIONS

COLUMNS = ("trial", "asked", "answered", "kind", "stage", "left", "right", "row", "column", "choice")
"""Of a record: `asked` and `answered` are ticks, `left` and `right` the moves, (row, column) is where both
clips begin."""
EVENT_COLUMNS = ("tick", "kind", "name", "value")
"""Of the record of an operator's event."""

Row = tuple[Any, ...]
Asked = tuple[str, int, str, str, int, int]


class AnswerLog:
    """The answers of a run in the order in which they were heard."""

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self.events: list[dict[str, Any]] = []
        self._open: dict[int, list[tuple[int, Asked]]] = {}

    def posted(self, query: Query, trials: Sequence[int], tick: int) -> None:
        """Note what is asked in a tick; `trials` are the numbers of the query's rows."""
        for row in (query.kind != QueryKind.NONE).nonzero().flatten().tolist():
            self._open.setdefault(trials[row], []).append((tick, describe(query, row)))

    def heard(self, answer: Answer, trials: Sequence[int], tick: int) -> None:
        """Note what is heard in a tick, each with the tick at which it was asked."""
        for row in (answer.choice != Choice.NONE).nonzero().flatten().tolist():
            trial, asked = trials[row], describe(answer.query, row)
            choice = Choice(int(answer.choice[row]))
            since = self._since(trial, asked, asked[0] == "guidance" and choice == Choice.SKIP)
            self.rows.append((trial, since, tick, *asked, choice.name.lower()))

    def applied(self, events: Sequence[Event], tick: int) -> None:
        """Note the operator's events that apply before a tick."""
        self.events += [event_record(tick, event.model_dump()) for event in events]

    def _since(self, trial: int, asked: Asked, again: bool) -> int:
        """Return when the oldest open question of these words was asked; `again` keeps it open."""
        waiting = self._open.get(trial, [])
        place = next((place for place, (_, one) in enumerate(waiting) if one == asked), None)
        if place is None:
            raise ValueError(f"parent: it answers trial {trial} a question that was not asked: {asked}.")
        return waiting[place][0] if again else waiting.pop(place)[0]

    def records(self) -> list[dict[str, Any]]:
        """Return the answers by trial, then in the order in which they were heard."""
        ordered = sorted(self.rows, key=lambda row: (row[0], row[2]))
        return [dict(zip(COLUMNS, row, strict=True)) for row in ordered]


def describe(query: Query, row: int) -> Asked:
    """Return what one trial asks, in words."""
    left, right = (
        " ".join(ACTIONS[code] for code in query.action[row, side, : int(query.length[row, side])].tolist())
        for side in (0, 1)
    )
    agent = query.agent[row, 0, 0].tolist()
    return (
        QueryKind(int(query.kind[row])).name.lower(),
        int(query.maturity[row]),
        left,
        right,
        agent[0],
        agent[1],
    )


def event_record(tick: int | None, event: Mapping[str, Any]) -> dict[str, Any]:
    """Return an operator's event as a record; each record has the same columns."""
    values = (tick, event["kind"], event.get("name"), event.get("value"))
    return dict(zip(EVENT_COLUMNS, values, strict=True))
