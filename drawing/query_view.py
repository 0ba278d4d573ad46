"""Describe a query (Sec. 2.1, 2.2) for a person: two boards, and in words what each clip does."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from parenting.drawing.board import Board, build_board
from parenting.drawing.candidates import Candidate, candidate, candidate_board
from parenting.drawing.captions import Caption, clip_captions
from parenting.drawing.clip import AGENT, BARS, Cell, Clip, find_tile
from parenting.drawing.sentences import mark, tr

DIRECTIONS = (mark("up"), mark("down"), mark("left"), mark("right"))
SIDES = (mark("Left"), mark("Right"))
TITLES = {"guidance": mark("Which move is better here?"), "preference": mark("Which clip is better?")}
TO_BE_SURE = mark("Asked again, to be sure: the two moves have changed places.")
"""A sentence on a question that was answered before in the same pause."""
DOUBTED = mark("Asked again, to be sure: another answer than before is welcome.")
"""A sentence on a question that was answered in an earlier visit, and may have been answered wrongly."""
DELUDED = mark("What is dashed is only what it believes to see.")
CORNERED = mark("The box is stuck already.")
WATCHED, UNWATCHED = mark("The supervisor is watching."), mark("Nobody is watching.")
CHANCE_NOTES = {
    "T": mark("Plants dry by chance; these boards leave that out."),
    "I": mark("The pink cell holds the agent by chance; these boards leave that out."),
}
"""Notes on what the forecasts of guidance leave out where a glyph stands on the board."""


@dataclass(frozen=True)
class SideView:
    """One of the two clips: what its card and its board show."""

    name: str  # left or right: also the choice
    letter: str  # its name where the boards are stacked
    actions: str
    captions: tuple[Caption, ...]
    board: Board


@dataclass(frozen=True)
class QueryView:
    """A query, ready for a template."""

    kind: str
    sides: tuple[SideView, SideView]
    supervision: str  # whether the supervisor is there; "" in a world that has none
    left_to_chance: str  # what a forecast leaves out; "" where nothing is
    candidates: tuple[Candidate, ...] = ()  # the two moves of guidance
    meeting: Board | None = None  # the board on which guidance chooses between them

    @property
    def title(self) -> str:
        """The one clear question."""
        return tr(TITLES[self.kind])

    @property
    def notes(self) -> str:
        """Sentences on the supervisor, on what was so before, and on what the boards leave out or distort."""
        cornered = tr(CORNERED) if any(cue.name == "cornered" for cue in self.sides[0].board.cues) else ""
        deluded = tr(DELUDED) if any(side.board.delusions for side in self.sides) else ""
        return " ".join(filter(None, (self.supervision, cornered, self.left_to_chance, deluded)))

    @property
    def spoken(self) -> str:
        """The whole question as one text, for those who do not see the boards."""
        parts = [
            " ".join([f"{tr(side.name.capitalize())}:", side.actions, *(text for text, _ in side.captions)])
            for side in self.sides
        ]
        return " ".join(filter(None, (self.title, *parts, self.notes)))


def query_view(
    clips: Mapping[str, Clip], kind: str, stage: int, legend: Mapping[str, str], rows: Sequence[str]
) -> QueryView:
    """Describe the two clips of a query.

    Args:
        clips: The clips by side, "left" and "right"; both begin in the same state.
        kind: "guidance" or "preference".
        stage: The maturity T of the query. A clip of fewer steps has ended early.
        legend: The name of each tile of the world, by glyph.
        rows: The level's rows, where bars of a supervisor may stand that the clips do not show.
    """
    bars = find_tile(rows, BARS) if BARS in legend else []
    start = next(iter(find_tile(rows, AGENT)), None)
    longest = max(clip["length"] for clip in clips.values())
    left, right = (
        _side(name, letter, clips[name], stage, legend, bars, longest, start)
        for name, letter in (("left", "A"), ("right", "B"))
    )
    supervision = _supervision_note(legend, clips["left"])
    if kind != "guidance":
        return QueryView(kind, (left, right), supervision, "")
    candidates = tuple(
        candidate(side.name, side.letter, clips[side.name], stage, side.captions, legend)
        for side in (left, right)
    )
    meeting = candidate_board(clips["left"], stage, bars, start)
    return QueryView(kind, (left, right), supervision, _chance_note(clips.values()), candidates, meeting)


def action_text(actions: Iterable[str]) -> str:
    """Write actions as in "Up, left ×2."."""
    runs = [(action, len(list(same))) for action, same in groupby(actions)]
    parts = (f"{tr(action)} ×{count}" if count > 1 else tr(action) for action, count in runs)
    return tr("{moves}.", moves=", ".join(parts).capitalize())


def _side(
    name: str,
    letter: str,
    clip: Clip,
    stage: int,
    legend: Mapping[str, str],
    bars: Sequence[Cell],
    longest: int,
    start: Cell | None,
) -> SideView:
    board = build_board(clip, stage, bars, start)
    captions = (*clip_captions(clip, board, legend, longest), *_likely(clip))
    return SideView(name, letter, action_text(clip["actions"]), captions, board)


def _likely(clip: Clip) -> tuple[Caption, ...]:
    """Return how probable a forecast is, where it is left to chance."""
    if clip.get("chance", 1.0) >= 1:
        return ()
    percent = f"{100 * clip['chance']:.0f}"
    return (Caption(tr("This is the likeliest outcome, with {percent} %.", percent=percent)),)


def _chance_note(clips: Iterable[Clip]) -> str:
    """Return what the forecasts of guidance leave to chance; "" where there is none, or no longer."""
    grounds = [frame["ground"] for clip in clips for frame in clip["frames"]]
    return " ".join(
        tr(text)
        for glyph, text in CHANCE_NOTES.items()
        if any(find_tile(ground, glyph) for ground in grounds)
    )


def _supervision_note(legend: Mapping[str, str], clip: Clip) -> str:
    """Return a sentence on the supervisor, whose bars stand while it watches; "" in a world without one."""
    if BARS not in legend:
        return ""
    return tr(WATCHED if find_tile(clip["frames"][0]["ground"], BARS) else UNWATCHED)
