"""A stored query as the parent's page shows it (Sec. 2.1, 2.2)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from parenting.drawing.board import Board
from parenting.drawing.candidates import with_margin
from parenting.drawing.clip import Clip
from parenting.drawing.query_view import DOUBTED, TO_BE_SURE, QueryView, query_view
from parenting.drawing.sentences import tr
from parenting.drawing.surroundings import surroundings
from parenting.server.damage import reading
from parenting.server.db import Database
from parenting.server.pages.texts import AGAIN, LEADS, PUT_BACK
from parenting.server.reads.asked_before import is_doubted
from parenting.server.tables import SKIP, Query, Run


@dataclass(frozen=True)
class Former:
    """The answer that stands for a question which is shown once more."""

    choice: str
    heard: bool  # the agent has heard it


class Onward(NamedTuple):
    """The link that leads away from a question which has an answer."""

    address: str
    text: str
    first: bool = False  # it has the focus, so that Enter follows it


@dataclass(frozen=True)
class QuestionView(QueryView):
    """A question, ready for web/templates/_question.html."""

    id: str = ""  # public, as all that the page sends back
    run: str = ""
    one_board: bool = False  # guidance on one board with both moves, and not on the paper's two
    former: Former | None = None
    around: tuple[str, ...] = ()  # the difference of the clips and the whole board, in sentences
    marks: tuple[str, str] = ("", "")  # the same for the same clip, left and right
    put_back: bool = False  # clips that somebody has skipped once
    confirmed: bool = False  # guidance has to be confirmed, so an answer that was heard may not have moved
    votes: int = 0  # answers heard on this pair of moves before, in the same pause
    doubted: bool = False  # an answer on this pair of moves in an earlier visit is doubted

    @property
    def action(self) -> str:
        """The address that the form is sent to."""
        return f"/runs/{self.run}/parent/{'change' if self.former else 'answer'}"

    @property
    def plain(self) -> bool:
        """True if the form itself is sent where scripts would send the answer otherwise."""
        return False

    @property
    def grid(self) -> str:
        """The address of its board as a grid of cells."""
        return f"/runs/{self.run}/parent/grid?query={self.id}"

    @property
    def onward(self) -> Onward:
        """The way on where an answer stands."""
        return Onward(f"/runs/{self.run}/parent", tr("Leave it as it is"))

    @property
    def lead(self) -> str:
        """A sentence on who waits for the answer, or on an earlier skip."""
        return tr(PUT_BACK if self.put_back else LEADS[self.kind])

    @property
    def repeat(self) -> str:
        """A sentence where the question is asked again: it is never shown as a plain repeat."""
        return tr(TO_BE_SURE) if self.votes else tr(DOUBTED) if self.doubted else ""

    @property
    def spoken(self) -> str:
        """The whole question as one text; the moves of one board have letters."""
        return " ".join(filter(None, (self.repeat, self.asked, *self.around)))

    @property
    def asked(self) -> str:
        """The question and its moves or clips, without the board."""
        if not self.one_board:
            return super().spoken
        moves = [
            " ".join([f"{move.letter}, {move.words}.", *(said.text for said in move.captions)])
            for move in self.candidates
        ]
        return " ".join(filter(None, (self.title, *moves, self.notes)))

    @property
    def forecasts(self) -> list[Board]:
        """The forecasts of both moves, as large as the board that they are played on."""
        return [with_margin(side.board) for side in self.sides]

    @property
    def names(self) -> dict[str, str]:
        """Return the name of each choice, as the button that takes it back tells it."""
        if self.one_board:
            sides = {move.side: f"{move.letter}, {tr(move.action)}" for move in self.candidates}
        else:
            sides = {side.name: tr(side.name.capitalize()) for side in self.sides}
        return {**sides, "either": tr("Either"), "neither": tr("Neither"), SKIP: tr("I can’t tell")}

    @property
    def again(self) -> str:
        """Sentences on the answer that stands, where there is one."""
        if self.former is None:
            return ""
        if self.former.choice == SKIP:
            return tr(AGAIN["skipped"])
        if not self.former.heard:
            return tr(AGAIN["unheard"])
        if self.kind == "guidance" and self.confirmed:
            return tr(AGAIN["voted"])
        moved = self.kind == "guidance" and self.former.choice != "neither"
        return tr(AGAIN["moved" if moved else "heard"])


def repeated_view(db: Database, query: Query, run: Run, former: Former | None = None) -> QuestionView:
    """Describe a stored query as `question_view` does, and say whether it doubts an earlier answer.

    Raises:
        DamagedRowError: it cannot be read, or does not fit the run's legend.
    """
    shown = question_view(query, run, former)
    with db.read() as session:
        doubted = is_doubted(session, query, bool(run.config.get("relabel")))
    return replace(shown, doubted=doubted)


def question_view(query: Query, run: Run, former: Former | None = None) -> QuestionView:
    """Describe a stored query with its run's legend and level.

    Raises:
        DamagedRowError: it cannot be read, or does not fit the run's legend.
    """
    with reading(query):
        one, guide = _is_on_one_board(query, run), run.words == "guide"
        described = describe(query.clips, query.kind, query.maturity, run.legend, _rows(run), one, guide)
        described |= {"put_back": query.put_back, "votes": query.votes}
        described["confirmed"] = bool(run.config.get("confirm"))
    return QuestionView(**described, id=query.public_id, run=run.public_id, former=former)


def describe(
    clips: Mapping[str, Clip],
    kind: str,
    stage: int,
    legend: Mapping[str, str],
    rows: Sequence[str],
    one_board: bool,
    guide: bool = False,
) -> dict[str, Any]:
    """Describe a question by its clips (`drawing.query_view.query_view`), and its board in words."""
    view = query_view(clips, kind, stage, legend, rows)
    around = surroundings(clips, legend, ("A", "B") if one_board else ("left", "right"), guide)
    marks = _mark(clips["left"]), _mark(clips["right"])
    return {**vars(view), "one_board": one_board, "around": around, "marks": marks}


def _mark(clip: Clip) -> str:
    """Return a few letters by which the page knows a clip again."""
    return hashlib.blake2b(json.dumps(clip).encode(), digest_size=6).hexdigest()


def side_names(query: Query, run: Run) -> tuple[str, str]:
    """Return the names of the two sides in sentences: letters of moves, or where clips are seen."""
    return ("A", "B") if _is_on_one_board(query, run) else ("left", "right")


def _is_on_one_board(query: Query, run: Run) -> bool:
    return query.kind == "guidance" and run.guidance_layout == "one"


def _rows(run: Run) -> list[str]:
    """Return the rows of the run's level, without its header (`envs.levels.spec.Level.text`)."""
    return run.level_text.rpartition("\n\n")[2].splitlines()
