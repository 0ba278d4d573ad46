"""A stored query as the parent's page shows it (Sec. 2.1, 2.2)."""

from __future__ import annotations

from dataclasses import dataclass

from parenting.drawing.board import Board
from parenting.drawing.candidates import with_margin
from parenting.drawing.query_view import QueryView, query_view
from parenting.drawing.surroundings import surroundings
from parenting.server.damage import reading
from parenting.server.pages.texts import AGAIN, LEADS
from parenting.server.tables import Query, Run


@dataclass(frozen=True)
class Former:
    """The answer that stands for a question which is shown once more."""

    choice: str
    heard: bool  # the agent has heard it


@dataclass(frozen=True)
class QuestionView(QueryView):
    """A question, ready for web/templates/_question.html."""

    id: str = ""  # public, as all that the page sends back
    run: str = ""
    one_board: bool = False  # guidance on one board with both moves, and not on the paper's two
    former: Former | None = None
    around: tuple[str, ...] = ()  # the difference of the clips and the whole board, in sentences

    @property
    def lead(self) -> str:
        """A sentence on who waits for the answer."""
        return LEADS[self.kind]

    @property
    def spoken(self) -> str:
        """The whole question as one text; the moves of one board have letters."""
        return " ".join((self.asked, *self.around))

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
            sides = {move.side: f"{move.letter}, {move.action}" for move in self.candidates}
        else:
            sides = {side.name: side.name.capitalize() for side in self.sides}
        return {**sides, "either": "Either", "neither": "Neither"}

    @property
    def again(self) -> str:
        """Sentences on the answer that stands, where there is one."""
        if self.former is None:
            return ""
        if not self.former.heard:
            return AGAIN["unheard"]
        moved = self.kind == "guidance" and self.former.choice != "neither"
        return AGAIN["moved" if moved else "heard"]


def question_view(query: Query, run: Run, former: Former | None = None) -> QuestionView:
    """Describe a stored query with its run's legend and level.

    Raises:
        DamagedRowError: it cannot be read, or does not fit the run's legend.
    """
    with reading(query):
        view = query_view(query.clips, query.kind, query.maturity, run.legend, _rows(run))
        one = query.kind == "guidance" and run.guidance_layout == "one"
        around = surroundings(query.clips, run.legend, ("A", "B") if one else ("left", "right"))
    return QuestionView(
        **vars(view), id=query.public_id, run=run.public_id, one_board=one, former=former, around=around
    )


def _rows(run: Run) -> list[str]:
    """Return the rows of the run's level, without its header (`envs.levels.spec.Level.text`)."""
    return run.level_text.rpartition("\n\n")[2].splitlines()
