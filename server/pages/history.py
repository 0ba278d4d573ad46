"""List the answers of a run with their clips, the last first, page by page."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal, NamedTuple
from urllib.parse import urlencode

from fastapi import Query, Request, Response

from parenting.drawing.sentences import mark, tr
from parenting.server import runs, tables
from parenting.server.access.guard import principal_of
from parenting.server.access.matrix import may
from parenting.server.admission import admitted_router
from parenting.server.api.names import RunId
from parenting.server.damage import sound
from parenting.server.db import Database
from parenting.server.deps import Db
from parenting.server.errors import DamagedRowError
from parenting.server.new_run import LARGEST_INT
from parenting.server.pages.measures_text import measures_text
from parenting.server.pages.question import QuestionView, question_view
from parenting.server.pages.render import moved, page
from parenting.server.pages.texts import parent_title
from parenting.server.persons import pseudonyms
from parenting.server.reads import answers
from parenting.server.reads.answers import Answered
from parenting.server.schemas import Said
from parenting.server.seats import COOKIE
from parenting.server.statuses import QueryStatus
from parenting.server.tables import SAID, SKIP, Run

router = admitted_router(include_in_schema=False)

PAGE = 20
"""Answers on a page."""

KIND_TEXTS = {"guidance": mark("guidance"), "preference": mark("preference")}
CHOICE_TEXTS = {
    "left": mark("Left is better"),
    "right": mark("Right is better"),
    "either": mark("Equally good"),
    "neither": mark("Both too dangerous"),
    "skip": mark("Skipped: could not tell"),
}
"""The meaning of a choice, in words."""
DELETED = mark("Deleted, as all that its person said")
CHOICE_NAMES = {**CHOICE_TEXTS, "left": mark("A or left is better"), "right": mark("B or right is better")}
"""The same where it is not said of which kind the question is."""

Before = Annotated[int | None, Query(ge=1, le=LARGEST_INT)]
OfKind = Annotated[Literal["guidance", "preference", ""], Query()]
OfChoice = Annotated[Said | Literal[""], Query()]


class Entry(NamedTuple):
    """One answer, ready for web/templates/answers.html."""

    number: int
    text: str
    chosen: tuple[str, ...]  # the sides that it favours
    fallen: str  # how it came that it stands no more; "" if it stands
    change: bool  # whoever looks gave it, and may change it
    who: str
    received: str  # in UTC, to the second
    measured: str  # what the page measured of it, for researchers; "" where nothing is told
    asked: int  # the tick of the question
    heard: int | None  # the tick at which the agent heard it
    stage: int
    shown: QuestionView


class DamagedEntry(NamedTuple):
    """An answer that cannot be read, or whose question cannot."""

    number: int | None
    damaged: str  # what cannot be read, and why


@dataclass(frozen=True)
class HistoryPage:
    """The content of web/templates/history.html."""

    run: Run
    title: str
    entries: Sequence[Entry | DamagedEntry]  # one page of them
    older: str | None  # the query string of the next page; None on the last one
    newest: str | None  # that of the first page; None on it
    kind: str  # the kind that is shown alone; "" for all
    choice: str  # the same for the choice
    kinds: Collection[str] = tuple(KIND_TEXTS)
    choices: Mapping[str, str] = field(default_factory=lambda: {name: CHOICE_NAMES[name] for name in SAID})


@router.get("/runs/{run_id}/history")
def history_page(
    request: Request, run_id: RunId, db: Db, before: Before = None, kind: OfKind = "", choice: OfChoice = ""
) -> Response:
    """The page. `before` is the number of an answer; kind and choice leave out the others."""
    run = runs.get_run(db, run_id)
    if (there := moved(request, run)) is not None:
        return there
    rows = answers.before(
        db, run_id, before, PAGE + 1, kind or None, choice or None, principal_of(request).client
    )
    kept = {name: value for name, value in (("kind", kind), ("choice", choice)) if value}
    context = HistoryPage(
        run,
        parent_title(run),
        _entries(rows[:PAGE], run, _me(request), known_people(db, [row.answer for row in rows])),
        urlencode({**kept, "before": _last_number(rows[:PAGE])}) if len(rows) > PAGE else None,
        urlencode(kept) if before is not None else None,
        kind,
        choice,
    )
    return page("history.html", **vars(context))


def _me(request: Request) -> str:
    return principal_of(request).client or request.cookies.get(COOKIE, "")


def _last_number(rows: Sequence[Answered]) -> int | None:
    return next((row.answer.number for row in reversed(rows) if row.placed), None)


def known_people(db: Database, given: Iterable[tables.Answer]) -> Mapping[str, str]:
    """Return the pseudonyms of those who gave these answers, by the names under which they answered.

    Whoever may not see the list of people is told none.
    """
    if not may("GET /persons"):
        return {}
    return pseudonyms(db, {name for answer in given if isinstance(name := sound(answer, "client_id"), str)})


def _entries(
    rows: Sequence[Answered], run: Run, mine: str, people: Mapping[str, str]
) -> list[Entry | DamagedEntry]:
    return [_entry(row, run, mine, people) for row in rows]


def _entry(row: Answered, run: Run, mine: str, people: Mapping[str, str]) -> Entry | DamagedEntry:
    answer, query = row.answer, row.query
    found = row.damage
    if found is not None:
        return DamagedEntry(sound(answer, "number"), found)
    try:
        shown = question_view(query, run)
    except DamagedRowError as error:
        return DamagedEntry(answer.number, error.message)
    return Entry(
        answer.number,
        tr(DELETED) if answer.erased is not None else said(answer.choice, shown),
        ("left", "right") if answer.choice == "either" else (answer.choice,),
        _fallen(answer, query),
        answer.standing and answer.parent == "human" and answer.client_id == mine,
        who(answer.parent, answer.client_id, mine, people),
        f"{answer.received:%Y-%m-%d %H:%M:%S}",
        "" if answer.measured is None else measures_text(answer.measured, answer.replays),
        query.tick,
        answer.applied_tick,
        query.maturity if query.policy_stage is None else query.policy_stage,
        shown,
    )


def said(choice: str, shown: QuestionView) -> str:
    """Say what a choice means; a move of one board has its letter."""
    sides = {move.side for move in shown.candidates} if shown.one_board else set()
    if choice in sides:
        return tr("{name}, is better", name=shown.names[choice])
    return tr(CHOICE_TEXTS[choice])


def _fallen(answer: tables.Answer, query: tables.Query) -> str:
    if answer.standing:
        return ""
    if answer.choice == SKIP and query.put_back:
        return tr("put back")
    back = query.status in (QueryStatus.OPEN, QueryStatus.WITHDRAWN)
    return tr("taken back") if back else tr("corrected later")


def who(parent: str, client_id: str, mine: str, people: Mapping[str, str]) -> str:
    """Say who answered, to the client `mine`; others by their pseudonyms, as `/persons` and exports do."""
    if parent == "scripted":
        return tr("a script")
    if client_id == mine:
        return tr("you, in this browser")
    return tr("a person ({name})", name=people[client_id]) if client_id in people else tr("a person")
