"""Draw a policy on the board of its level (SVG): arrows in each cell, as long as their actions are likely."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from parenting.drawing.clip import MOVES, Cell
from parenting.drawing.level import level_board
from parenting.drawing.render import standalone
from parenting.drawing.trail import Point, centre
from parenting.envs import registry
from parenting.envs.levels.spec import Level, WorldSpec

LEAST = 0.05
"""The probability below which an action has no arrow."""
SHORTEST, LONGEST = 3.0, 9.0
"""The length of an arrow of probability 0 and 1, in units of which a cell has 20."""


def draw_policy(
    level: Level, probabilities: Mapping[Cell, Sequence[float]], spec: WorldSpec | None = None
) -> str:
    """Return a policy as the text of an SVG file: its arrows on the board, in light and dark colours.

    The likeliest action of a cell is drawn dark, the others faint; ties are all dark.

    Args:
        level: The level, drawn as an episode begins.
        probabilities: For cells by (row, column), the probabilities of up, down, left and right. Other cells
            have no arrows.
        spec: The level's world. By default it is the registered world of that name.

    Raises:
        UnknownWorldError: `spec` is missing and no world of this name is registered.
        ValueError: a cell has not four probabilities.
    """
    spec = spec or registry.spec(level.world, level)
    arrows = policy_arrows(probabilities)
    return standalone(
        "policy.svg",
        board=level_board(level),
        legend=spec.legend,
        title=f"Policy on {spec.title}: {level.name}",
        likely=arrows.likely,
        less=arrows.less,
    )


class Arrows(NamedTuple):
    """The arrows of a policy as SVG path data: those of the likeliest actions, and the others."""

    likely: str
    less: str


def policy_arrows(probabilities: Mapping[Cell, Sequence[float]]) -> Arrows:
    """Return the arrows of a policy, as long as their actions are likely.

    Raises:
        ValueError: a cell has not four probabilities.
    """
    likely: list[str] = []
    less: list[str] = []
    for cell, row in sorted(probabilities.items()):
        if len(row) != len(MOVES):
            raise ValueError(f"Cell {cell} has {len(row)} probabilities; give 4: up, down, left and right.")
        for way, probability in zip(MOVES, row, strict=True):
            if probability >= LEAST:
                best = probability >= max(row) - 1e-6
                (likely if best else less).append(_arrow(centre(cell), MOVES[way], probability))
    return Arrows("".join(likely), "".join(less))


def _arrow(start: Point, move: Cell, probability: float) -> str:
    """The outline of an arrow from the middle of a cell, as SVG path data."""
    length = SHORTEST + (LONGEST - SHORTEST) * probability
    shaft, head = 0.4 + 0.5 * probability, 1.4 + 1.6 * probability
    neck = length - 1.5 * head
    outline = (
        (0, shaft),
        (neck, shaft),
        (neck, head),
        (length, 0),
        (neck, -head),
        (neck, -shaft),
        (0, -shaft),
    )
    (x, y), (dy, dx) = start, move
    points = [(x + along * dx - aside * dy, y + along * dy + aside * dx) for along, aside in outline]
    return "M" + "L".join(f"{round(a, 2):g},{round(b, 2):g}" for a, b in points) + "z"
