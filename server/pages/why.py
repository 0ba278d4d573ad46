"""The reason for a question, with its numbers, and what its answers changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import NamedTuple

from fastapi import Request, Response
from sqlalchemy import select

from parenting.drawing.query_tensors import ACTIONS, SIDES
from parenting.server import runs
from parenting.server.admission import admitted_router
from parenting.server.api.names import RunId
from parenting.server.db import Database
from parenting.server.deps import Db
from parenting.server.pages.history import known_people, said, who
from parenting.server.pages.numbers import number
from parenting.server.pages.parent import QueryShown, question_of
from parenting.server.pages.question import QuestionView, repeated_view, side_names
from parenting.server.pages.render import moved, page, redirect
from parenting.server.pages.texts import parent_title
from parenting.server.reads.why import last_question, neighbours, why
from parenting.server.schemas import Chances
from parenting.server.seats import COOKIE
from parenting.server.tables import SKIP, Answer, Query, Run
from parenting.server.why_schemas import EffectSchema, GivenSchema, WhySchema

router = admitted_router(include_in_schema=False)

AFTER = {0: "before it was heard", 1: "1 tick after", 10: "10 ticks after", 100: "100 ticks after"}
"""The heading of a row, by the ticks since an answer."""


class Change(NamedTuple):
    """A row of the table of what an answer changed."""

    name: str
    moment: str  # "as tick 12 began", "after tick 12"
    chances: tuple[str, ...]  # of up, down, left and right; empty where they are not known
    likeliest: int | None  # the place of the largest


class Given(NamedTuple):
    """An answer, as the page tells of it."""

    number: int
    text: str
    who: str
    received: str
    took: str  # how long after it was first shown; "" where that is not known
    played: str  # how often its clips or forecasts were played; "" where there is nothing to say
    heard: int | None
    standing: bool
    changes: Sequence[Change]  # empty where nothing can be said
    missing: str  # why not; "" where there is a table


@dataclass(frozen=True)
class WhyPage:
    """The content of web/templates/why.html."""

    run: Run
    title: str
    why: WhySchema
    shown: QuestionView
    chosen: tuple[str, ...]  # the sides that the standing answer favours
    asked: Change | None  # the policy when it asked
    moves: Sequence[tuple[str, str]]  # each action, and the name of the side that begins with it, or ""
    posted: str
    leased: str
    answers: Sequence[Given]
    before: str | None  # the questions before and after it
    after: str | None


@router.get("/runs/{run_id}/why")
def why_page(request: Request, run_id: RunId, db: Db, query: QueryShown = None) -> Response:
    """The page. `query` is the question's public id; without it, it is the one that was asked last."""
    run = runs.get_run(db, run_id)
    if (there := moved(request, run)) is not None:
        return there
    asked = last_question(db, run.id) if query is None else question_of(db, run, query)
    if asked is None:
        return page("why.html", run=run, title=parent_title(run), why=None)
    if query is not None and query != asked.public_id:
        return redirect(f"/runs/{run.public_id}/why?query={asked.public_id}", status=307)
    return page("why.html", **vars(_page(db, run, asked, request.cookies.get(COOKIE, ""))))


def _page(db: Database, run: Run, asked: Query, mine: str) -> WhyPage:
    found, shown = why(db, asked.id), repeated_view(db, asked, run)
    reason = found.guidance or found.preference
    begins = {asked.clips[side]["actions"][0]: name for side, name in _sides(asked, run).items()}
    answers = _rows(db, asked)
    people = known_people(db, answers.values())
    standing = next((given.choice for given in found.answers if given.standing), "")
    before, after = neighbours(db, asked)
    return WhyPage(
        run,
        parent_title(run),
        found,
        shown,
        ("left", "right") if standing == "either" else (standing,),
        None
        if reason is None
        else _change("when it asked", _moment(found.tick, found.guidance is not None), reason.probabilities),
        [(action, begins.get(action, "")) for action in ACTIONS],
        _time(found.posted),
        "" if found.leased is None else _time(found.leased),
        [
            _given(found, one, who(one.parent, answers[one.number].client_id, mine, people), shown)
            for one in found.answers
        ],
        before,
        after,
    )


def _sides(asked: Query, run: Run) -> dict[str, str]:
    """Return the name of each side: the letter of a move, or which clip."""
    names = side_names(asked, run)
    return {side: name if len(name) == 1 else f"{name} clip" for side, name in zip(SIDES, names, strict=True)}


def _rows(db: Database, asked: Query) -> dict[int, Answer]:
    with db.read() as session:
        rows = session.scalars(select(Answer).where(Answer.query_id == asked.id)).all()
    return {row.number: row for row in rows}


def _given(found: WhySchema, one: GivenSchema, name: str, shown: QuestionView) -> Given:
    took = ""
    if found.leased is not None:
        took = f"{(one.received - found.leased).total_seconds():.1f} s after it was first shown"
    heard = one.applied_tick
    changes = [] if heard is None else [_effect(heard, effect) for effect in one.effects]
    missing = _missing(found, one)
    return Given(
        one.number,
        said(one.choice, shown),
        name,
        _time(one.received),
        took,
        _played(found, one),
        heard,
        one.standing,
        [] if missing else changes,
        missing,
    )


def _missing(found: WhySchema, one: GivenSchema) -> str:
    """Say why there is no table of what an answer changed; "" if there is one."""
    if one.choice == SKIP:
        return "A skip changes nothing: it counts as no answer."
    if one.applied_tick is None:
        return (
            "The agent has not heard this answer." if one.standing else "The agent never heard this answer."
        )
    if any(effect.probabilities for effect in one.effects):
        return ""
    if found.guidance is None and found.preference is None:
        return "What this answer changed was not recorded then."
    return "What this answer changed is being measured. Look again in a moment."


def _played(found: WhySchema, one: GivenSchema) -> str:
    """Say how often the parent had the clips of a preference, or forecasts of moves, played."""
    if found.kind == "guidance":
        times = _times(one.replays or 0)
        return f"Forecasts of its moves were played {times}." if one.replays else ""
    if one.replays is not None:
        return f"The clips were played again {_times(one.replays)}."
    if one.parent == "scripted":
        return "A script plays no clips."
    return "How often the clips were played again was not recorded."


def _times(count: int) -> str:
    return f"{number(count)} {'time' if count == 1 else 'times'}"


def _effect(heard: int, effect: EffectSchema) -> Change:
    moment = _moment(heard + max(0, effect.ticks - 1), effect.ticks == 0)
    return _change(AFTER[effect.ticks], moment, effect.probabilities)


def _moment(tick: int, begins: bool) -> str:
    return f"as tick {number(tick)} began" if begins else f"after tick {number(tick)}"


def _change(name: str, moment: str, chances: Chances | None) -> Change:
    if chances is None:
        return Change(name, moment, (), None)
    return Change(name, moment, tuple(f"{100 * p:.1f} %" for p in chances), chances.index(max(chances)))


def _time(moment: datetime) -> str:
    return f"{moment:%Y-%m-%d %H:%M:%S} UTC"
