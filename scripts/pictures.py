"""Draw the pictures that need no browser: `make pictures`. The tests hold them up to date."""

from __future__ import annotations

from collections.abc import Callable
from math import exp
from pathlib import Path

from parenting.drawing.animated_query import animate_query
from parenting.drawing.clip import MOVES, Cell, Clip
from parenting.drawing.policy import draw_policy
from parenting.drawing.query import draw_query
from parenting.drawing.render import standalone
from parenting.drawing.signs import draw_signs
from parenting.drawing.walk import walk
from parenting.envs import registry
from parenting.envs.levels.spec import AGENT, GOAL, LAND, WALL, Level

ROOT = Path(__file__).parents[1]
ISLAND = registry.level("unsafe-exploration", "island")
STAGE = 4
DROWNS, ARRIVES = ("left", "left", "left"), ("down", "down", "down", "left")
"""Two clips on the island from its start."""


def clips() -> dict[str, Clip]:
    """Return the two clips of the query."""
    return {"left": walk(ISLAND, DROWNS), "right": walk(ISLAND, ARRIVES)}


def policy(level: Level) -> dict[Cell, list[float]]:
    """Return a policy that prefers short and safe ways: the softmax of minus the distance after a move."""
    distance = {level.find(GOAL)[0]: 0}
    fringe = list(distance)
    while fringe:
        cell = fringe.pop(0)
        for move in MOVES.values():
            other = (cell[0] + move[0], cell[1] + move[1])
            if other not in distance and other in level.find(LAND + AGENT):
                distance[other] = distance[cell] + 1
                fringe.append(other)
    found = {}
    for cell in level.find(LAND + AGENT):
        after = [(cell[0] + move[0], cell[1] + move[1]) for move in MOVES.values()]
        far = [distance[cell] if _wall(level, other) else distance.get(other, 99) for other in after]
        weights = [exp(-2 * steps) for steps in far]
        found[cell] = [weight / sum(weights) for weight in weights]
    return found


def _wall(level: Level, cell: Cell) -> bool:
    inside = 0 <= cell[0] < level.height and 0 <= cell[1] < level.width
    return not inside or level.glyph(cell) == WALL


def query() -> str:
    """Return the query as a picture that stands still."""
    return draw_query(clips(), ISLAND, "preference", STAGE)


def question() -> str:
    """Return the query and its answer as a moving picture."""
    return animate_query(clips(), ISLAND, "preference", "right", STAGE)


PICTURES: dict[str, Callable[[], str]] = {
    "docs/pictures/query.svg": query,
    "docs/pictures/question.svg": question,
    "web/static/query.svg": query,
    "web/static/question.svg": question,
    "docs/pictures/signs.svg": draw_signs,
    "docs/pictures/policy.svg": lambda: draw_policy(ISLAND, policy(ISLAND)),
    "web/static/icon.svg": lambda: standalone("icon.svg"),
}
"""The pictures, by their paths in the repository."""


if __name__ == "__main__":
    for name, draw in PICTURES.items():
        (ROOT / name).write_text(draw() + "\n", encoding="utf-8")
