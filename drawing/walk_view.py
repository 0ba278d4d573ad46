"""Describe a walk for a person: the clip of an episode, the policy in every cell, and both in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from parenting.drawing.board import Board, build_board
from parenting.drawing.captions import ENDS, Caption, clip_captions, ends_on
from parenting.drawing.clip import MOVES, Cell, Clip, tile_under_agent
from parenting.drawing.policy import Arrows, policy_arrows
from parenting.drawing.query_view import action_text
from parenting.drawing.sentences import tr, trn

GOAL = "G"


@dataclass(frozen=True)
class PolicyView:
    """The policy in every cell of a board."""

    board: Board  # as an episode begins
    arrows: Arrows
    words: tuple[str, ...]  # a sentence for each row of the board


@dataclass(frozen=True)
class WalkView:
    """A walk, ready for web/templates/_walk.html."""

    board: Board
    policy: PolicyView
    end: Caption  # how it ended
    captions: tuple[Caption, ...]  # what happened on the way
    actions: str

    @property
    def spoken(self) -> str:
        """The walk in sentences."""
        return " ".join([self.end.text, *(said.text for said in self.captions)])


def walk_view(
    clip: Clip,
    end: str,
    unsafe: Sequence[int],
    cells: Mapping[Cell, Sequence[float]],
    legend: Mapping[str, str],
) -> WalkView:
    """Describe a walk.

    Args:
        clip: The walk, frame by frame.
        end: How it ended: goal, harm, held or time.
        unsafe: The unsafe steps, counted from 1.
        cells: The probabilities of up, down, left and right in each cell.
        legend: The name of each tile of the world, by glyph.
    """
    stage = clip["length"] + (end == "held")  # a clip that was held is one that has ended early
    board = build_board(clip, stage)
    found = clip_captions(clip, board, legend) if clip["length"] else ()
    ends = {tr(whole) for whole, _, _ in ENDS.values()}
    ends.add(ends_on(tile_under_agent(clip["frames"][-1]), legend))  # the sentence on the end says it, too
    captions = tuple(said for said in found if said.text not in ends)
    if clip["length"]:
        captions = (_safety(unsafe, clip["length"]), *captions)
    return WalkView(
        board,
        policy_view(clip, cells),
        _end(end, clip["length"], GOAL in legend, board),
        captions,
        action_text(clip["actions"]) if clip["length"] else "",
    )


def policy_view(clip: Clip, cells: Mapping[Cell, Sequence[float]]) -> PolicyView:
    """Describe a policy on the board on which a clip begins."""
    still = Clip(actions=[], length=0, frames=clip["frames"][:1])
    return PolicyView(build_board(still), policy_arrows(cells), tuple(_rows(cells)))


def percent(probability: float) -> str:
    """Write a probability in percent; what is rare is not said to be impossible."""
    return (
        tr("under 1\N{NO-BREAK SPACE}%")
        if 0 < probability < 0.005
        else f"{100 * probability:.0f}\N{NO-BREAK SPACE}%"
    )


def _end(end: str, steps: int, has_goal: bool, board: Board) -> Caption:
    after = trn("after {count} step", "after {count} steps", steps)
    if end == "goal":
        return Caption(tr("It reached the goal {after}.", after=after), "good")
    if end == "harm" and any(cue.name == "drown" for cue in board.cues):
        return Caption(tr("It went into the water {after}.", after=after), "bad")
    if end == "harm":
        return Caption(tr("It came to harm {after}.", after=after), "bad")
    if end == "held":
        return Caption(tr("The interruption held it {after}.", after=after))
    if has_goal:
        return Caption(tr("{after} it was not at the goal.", after=after.capitalize()))
    return Caption(trn("It walked {count} step.", "It walked {count} steps.", steps))


def _safety(unsafe: Sequence[int], steps: int) -> Caption:
    if not unsafe:
        return Caption(tr("None of its steps was unsafe."), "good")
    if steps == 1:
        return Caption(tr("Its step was unsafe."), "bad")
    said = trn(
        "{count} of its {steps} steps was unsafe.",
        "{count} of its {steps} steps were unsafe.",
        len(unsafe),
        steps=steps,
    )
    return Caption(said, "bad")


def _rows(cells: Mapping[Cell, Sequence[float]]) -> list[str]:
    """Return a sentence for each row: the likeliest move of each of its cells, counted from the top left."""
    ways = tuple(MOVES)
    sentences = []
    for row, found in groupby(sorted(cells), key=lambda cell: cell[0]):
        parts = []
        for cell in found:
            best = max(range(len(ways)), key=cells[cell].__getitem__)
            parts.append(
                tr(
                    "column {column} {way} ({percent})",
                    column=cell[1] + 1,
                    way=tr(ways[best]),
                    percent=percent(cells[cell][best]),
                )
            )
        sentences.append(tr("Row {row}: {columns}.", row=row + 1, columns=", ".join(parts)))
    return sentences
