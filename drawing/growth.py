"""Draw the growth of an agent as a line: a share, by the number of answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from parenting.drawing.sentences import tr, trn
from parenting.drawing.walk_view import percent

WIDTH, HEIGHT = 320, 90
"""The size of the line's field, in units of its drawing."""


@dataclass(frozen=True)
class GrowthView:
    """A growth line, ready for web/templates/_growth.html."""

    line: str  # SVG path data
    end: tuple[float, float]  # its last point
    answers: int
    spoken: str  # the last point in a sentence


def growth_view(points: Sequence[tuple[int, float]], cells: int | None) -> GrowthView:
    """Describe a line through points of (answers, share), ordered by answers.

    Args:
        points: At least one point.
        cells: The number of cells that the shares are of; None in a world without a goal, where they are
            those of what could be earned.
    """
    most = max(1, points[-1][0])
    places = [(round(WIDTH * answers / most, 1), round(HEIGHT * (1 - share), 1)) for answers, share in points]
    if len(places) == 1:
        places = [(0.0, places[0][1]), (float(WIDTH), places[0][1])]
    answers, share = points[-1]
    after = trn("After {count} answer", "After {count} answers", answers)
    if cells is None:
        said = tr(
            "{after} it earns {percent} of what could be expected.", after=after, percent=percent(share)
        )
    else:
        said = tr(
            "{after} it reaches the goal safely from {percent} of {cells} cells.",
            after=after,
            percent=percent(share),
            cells=cells,
        )
    line = "M" + "L".join(f"{x:g},{y:g}" for x, y in places)
    return GrowthView(line, places[-1], answers, said)
