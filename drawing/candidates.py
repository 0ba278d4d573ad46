"""The two candidate moves of a guidance query (Sec. 2.1), as arrows on one board and in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from parenting.drawing.board import Board, build_board
from parenting.drawing.captions import Caption, ends_on
from parenting.drawing.clip import (
    BARS,
    BOX,
    MOVES,
    WALL,
    WATER,
    Cell,
    Clip,
    ahead,
    cell,
    tile_at,
    tile_under_agent,
)
from parenting.drawing.cues import DANGERS, find_cues
from parenting.drawing.sentences import mark, tr
from parenting.drawing.symbols import TURNS
from parenting.drawing.trail import CELL, Point, centre

PLACES = {
    " ": mark("onto land"),
    "W": mark("into the water"),
    "G": mark("onto the goal"),
    "O": mark("into the bucket"),
    "B": mark("onto the button"),
    "P": mark("onto the shortcut"),
    "T": mark("onto a watered plant"),
    "t": mark("onto a dry plant"),
    "I": mark("onto the pink cell"),
}
"""The words for a step onto a tile, by its glyph."""
AGAINST = {WALL: mark("against a wall"), BARS: mark("against the bars"), BOX: mark("against the box")}
"""The words for a step that is blocked, by the glyph in its way."""
STAYS = mark("stays here")
FALLS = mark("falls ({tile}), and is put back")
SAID = (
    mark("Ends in the water."),
    mark("Reaches the goal."),
    mark("Runs into a wall."),
    mark("Falls, and is put back."),
)
"""Captions that the words of a single step say already."""


@dataclass(frozen=True)
class Candidate:
    """A candidate move: its arrow on the board, and where it leads."""

    side: str  # left or right: the choice that is stored
    letter: str
    action: str
    leads: str  # "into the water"
    tone: str  # as of drawing.captions.Caption
    start: Point  # the middle of the agent's cell
    target: Point  # the upper left corner of the cell that the move leads to
    blocked: bool  # the move ends where it began
    captions: tuple[Caption, ...]  # what else its forecast shows

    @property
    def words(self) -> str:
        """The move and where it leads, in words."""
        return tr("{move}: {leads}", move=tr(self.action), leads=self.leads)

    @property
    def turn(self) -> int:
        """The degrees by which its arrow, which points right, is turned."""
        return TURNS[self.action]


def candidate(
    side: str, letter: str, clip: Clip, stage: int, captions: tuple[Caption, ...], legend: Mapping[str, str]
) -> Candidate:
    """Describe the first step of a forecast, which is the candidate move."""
    before, after = clip["frames"][:2]
    action = clip["actions"][0]
    first = Clip(actions=[action], length=1, frames=[before, after])
    names = {cue.name for cue in find_cues(first, stage)}
    row, column = place = ahead(before["agent"], action)
    certain = clip.get("chance", 1.0) >= 1  # else it may have slipped, and not have come to the water
    back = certain and tile_at(before["ground"], place) == WATER and cell(after["agent"]) != place
    blocked = before["agent"] == after["agent"]
    said = {*map(tr, SAID), ends_on(tile_under_agent(after), legend)} if clip["length"] == 1 else set()
    return Candidate(
        side,
        letter,
        action,
        _leads(first, place, legend, back),
        "bad" if back or names & DANGERS else "good" if "reach" in names else "",
        centre(cell(before["agent"])),
        (column * CELL, row * CELL),
        blocked,
        tuple(caption for caption in captions if caption.text not in said),
    )


def candidate_board(clip: Clip, stage: int, bars: list[Cell], start: Cell | None = None) -> Board:
    """Return the board as the agent meets it, before either move."""
    now = Clip(actions=[], length=0, frames=clip["frames"][:1])
    return with_margin(build_board(now, stage, bars, start))


def with_margin(board: Board) -> Board:
    """Return a board with a whole cell of wall around it, where the arrow of a blocked move is drawn."""
    x, y, width, height = board.view
    half = CELL // 2
    return replace(board, view=(x - half, y - half, width + CELL, height + CELL))


def _leads(step: Clip, place: Cell, legend: Mapping[str, str], back: bool) -> str:
    """Return where a move leads; `back`: it falls, and the world puts the agent back."""
    before, after = step["frames"]
    if back:
        return tr(FALLS, tile=tr(legend.get(WATER, WATER)).lower())
    if before["agent"] == after["agent"]:
        return _against(before["ground"], before["box"], place)
    return _onto(step, legend)


def _onto(step: Clip, legend: Mapping[str, str]) -> str:
    before, after = step["frames"]
    if before["box"] != after["box"]:
        return tr("pushes the box")
    tile = tile_under_agent(after)
    if before["agent"] not in _beside(after["agent"]):  # carried elsewhere by the world
        return tr("ends on {tile}", tile=tr(legend.get(tile, tile)).lower())
    if tile in PLACES:
        return tr(PLACES[tile])
    return tr("onto {tile}", tile=tr(legend.get(tile, tile)).lower())


def _against(ground: list[str], box: list[int] | None, place: Cell) -> str:
    if box is not None and cell(box) == place:
        return tr("against the box")
    return tr(AGAINST.get(tile_at(ground, place), STAYS))


def _beside(place: list[int]) -> list[list[int]]:
    return [[place[0] + down, place[1] + right] for down, right in MOVES.values()]
