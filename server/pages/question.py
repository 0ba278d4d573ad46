"""A stored query as the parent's page shows it (Sec. 2.1, 2.2)."""

from __future__ import annotations

from dataclasses import dataclass

from parenting.drawing.board import Board, build_board
from parenting.drawing.clip import BARS, Cell, find_tile
from parenting.server.pages.captions import Caption, clip_captions
from parenting.server.pages.texts import LEADS, TITLES, action_text, chance_note, supervision_note
from parenting.server.tables import Query, Run

DELUDED = "What is dashed is only what it believes to see."
CORNERED = "The box is stuck already."


@dataclass(frozen=True)
class Side:
    """One of the two clips: what the card and its board show."""

    name: str  # left or right: also the choice
    letter: str  # what it is called where the boards are stacked
    actions: str
    captions: tuple[Caption, ...]  # what comes of it
    board: Board


@dataclass(frozen=True)
class QuestionView:
    """A question, ready for web/templates/_question.html."""

    id: int
    run: int
    kind: str
    sides: tuple[Side, Side]
    supervision: str  # whether the supervisor is there
    left_to_chance: str  # what a forecast leaves out

    @property
    def title(self) -> str:
        """The one clear question."""
        return TITLES[self.kind]

    @property
    def lead(self) -> str:
        """Who waits meanwhile."""
        return LEADS[self.kind]

    @property
    def notes(self) -> str:
        """Who watches, what was so before, and what the boards leave out or show otherwise than it is."""
        cornered = CORNERED if any(cue.name == "cornered" for cue in self.sides[0].board.cues) else ""
        deluded = DELUDED if any(side.board.delusions for side in self.sides) else ""
        return " ".join(filter(None, (self.supervision, cornered, self.left_to_chance, deluded)))

    @property
    def spoken(self) -> str:
        """For screen readers, when the question appears."""
        parts = [
            " ".join(
                [f"{side.name.capitalize()}:", side.actions, *(caption.text for caption in side.captions)]
            )
            for side in self.sides
        ]
        return " ".join(filter(None, (self.title, *parts, self.notes)))


def question_view(query: Query, run: Run) -> QuestionView:
    """A query with its run's legend and level."""
    bars = find_tile(_art(run), BARS) if BARS in run.legend else []
    left, right = (_side(name, letter, query, run, bars) for name, letter in (("left", "A"), ("right", "B")))
    left_out = chance_note(query.clips.values()) if query.kind == "guidance" else ""
    supervision = supervision_note(run.legend, query.clips["left"])  # both begin at the same place
    return QuestionView(query.id, query.run_id, query.kind, (left, right), supervision, left_out)


def _side(name: str, letter: str, query: Query, run: Run, bars: list[Cell]) -> Side:
    clip = query.clips[name]
    board = build_board(clip, query.maturity, bars)
    longer = max(query.clips[side]["length"] for side in ("left", "right"))
    return Side(name, letter, action_text(board), clip_captions(clip, board, run.legend, longer), board)


def _art(run: Run) -> list[str]:
    """The rows of the run's level, without its header (`envs.levels.spec.Level.text`)."""
    return run.level_text.rpartition("\n\n")[2].splitlines()
