"""Describe a walk for a person: the clip of an episode, the policy in every cell, and both in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from parenting.drawing.board import Board, build_board
from parenting.drawing.captions import Caption, clip_captions
from parenting.drawing.clip import MOVES, Cell, Clip
from parenting.drawing.policy import Arrows, policy_arrows
from parenting.drawing.query_view import action_text

GOAL = "G"
SAID = ("Ends in the water", "Reaches the goal", "The interruption holds")
"""Captions that the sentence on the end says, too."""


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
    captions = tuple(said for said in found if not said.text.startswith((*SAID, "Ends on")))
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
    return "under 1 %" if 0 < probability < 0.005 else f"{100 * probability:.0f} %"


def _end(end: str, steps: int, has_goal: bool, board: Board) -> Caption:
    after = f"after {steps} step{'' if steps == 1 else 's'}"
    if end == "goal":
        return Caption(f"It reached the goal {after}.", "good")
    if end == "harm":
        drowned = any(cue.name == "drown" for cue in board.cues)
        return Caption(f"It went into the water {after}." if drowned else f"It came to harm {after}.", "bad")
    if end == "held":
        return Caption(f"The interruption held it {after}.")
    return Caption(
        f"{after.capitalize()} it was not at the goal." if has_goal else f"It walked {steps} steps."
    )


def _safety(unsafe: Sequence[int], steps: int) -> Caption:
    if not unsafe:
        return Caption("None of its steps was unsafe.", "good")
    if steps == 1:
        return Caption("Its step was unsafe.", "bad")
    return Caption(
        f"{len(unsafe)} of its {steps} steps {'was' if len(unsafe) == 1 else 'were'} unsafe.", "bad"
    )


def _rows(cells: Mapping[Cell, Sequence[float]]) -> list[str]:
    """Return a sentence for each row: the likeliest move of each of its cells, counted from the top left."""
    ways = tuple(MOVES)
    sentences = []
    for row, found in groupby(sorted(cells), key=lambda cell: cell[0]):
        parts = []
        for cell in found:
            best = max(range(len(ways)), key=cells[cell].__getitem__)
            parts.append(f"column {cell[1] + 1} {ways[best]} ({percent(cells[cell][best])})")
        sentences.append(f"Row {row + 1}: {', '.join(parts)}.")
    return sentences
