"""`show`: queries, levels and policies as pictures, in a notebook and out of one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from urllib.parse import quote

import numpy as np
import torch

from parenting.drawing.clip import Cell
from parenting.drawing.level import draw_level
from parenting.drawing.policy import draw_policy
from parenting.drawing.query import draw_query
from parenting.drawing.query_tensors import read_clips
from parenting.envs.levels.spec import BOX, Level
from parenting.library.policy import Policy
from parenting.library.question import Query, Question
from parenting.library.text import both_clips
from parenting.library.worlds import World

SHOWN = 4
"""Questions of a query that a notebook draws at most."""


@dataclass(frozen=True, repr=False)
class Drawing:
    """Pictures, and the same as text.

    Attributes:
        pictures: Each picture as the text of an SVG file, in light and dark colours.
        text: The same as rows of glyphs; it is the representation in a terminal.
    """

    pictures: Sequence[str]
    text: str

    def save(self, path: str | Path) -> Path:
        """Write the picture to an SVG file.

        Raises:
            ValueError: There is not exactly one picture.
        """
        if len(self.pictures) != 1:
            raise ValueError(
                f"save writes one picture, and here are {len(self.pictures)}. Show one thing alone."
            )
        Path(path).write_text(self.pictures[0], encoding="utf-8")
        return Path(path)

    def __repr__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        """Return images: inside them, styles and names of a picture do not meet those of the notebook."""
        images = [
            f'<img alt="{escape(self.text, quote=True)}" src="data:image/svg+xml;utf8,{quote(svg)}">'
            for svg in self.pictures
        ]
        return "\n".join(images)


def show(thing: Query | Question | Level | Policy | World) -> Drawing:
    """Draw a query, a question, a level, a world's levels, or a policy.

    In a notebook the result shows itself; in a terminal it is text; `save` writes an SVG file.

    Args:
        thing: What to draw. Of a policy, arrows on its level: what it does in each cell that the agent can
            come to, with everything else as an episode begins.

    Returns:
        The drawing.

    Raises:
        TypeError: Nothing that can be drawn.

    Example:
        >>> import parenting as pt
        >>> world = pt.make("unsafe-exploration")
        >>> pt.show(world.levels[0])
        WW######
        WW  A  W
        WW     W
        W      W
        W  G  WW
        W#######
    """
    match thing:
        case Query():
            questions = [one for one, _ in zip(thing, range(SHOWN), strict=False)]
            return Drawing([_question(one) for one in questions], "\n\n".join(map(both_clips, questions)))
        case Question():
            return Drawing([_question(thing)], both_clips(thing))
        case Level():
            return Drawing([draw_level(thing)], "\n".join(thing.rows))
        case World():
            texts = ["\n".join(level.rows) for level in thing.levels]
            return Drawing([draw_level(level, thing.spec) for level in thing.levels], "\n\n".join(texts))
        case Policy():
            return _policy(thing)
    raise TypeError(f"thing: a {type(thing).__name__} cannot be drawn; a query, level, world or policy can.")


def _question(question: Question) -> str:
    query = question.query
    level = query.world.levels[int(query.level[0])]
    clips = read_clips(query, query.world.legend)
    return draw_query(clips, level, question.kind, question.stage, query.world.spec)


def _policy(policy: Policy) -> Drawing:
    each = [arrows(policy, place) for place in range(len(policy.world.levels))]
    pictures = [
        draw_policy(level, found, policy.world.spec)
        for level, found in zip(policy.world.levels, each, strict=True)
    ]
    texts = [_as_text(level, found) for level, found in zip(policy.world.levels, each, strict=True)]
    return Drawing(pictures, "\n\n".join(texts))


def arrows(policy: Policy, place: int = 0) -> dict[Cell, list[float]]:
    """Return pi(a|s) in every cell that the agent can come to, the rest as an episode begins there."""
    world = policy.world
    start = world.beginnings().pick(torch.tensor([place]))
    level = world.levels[place]
    ends = {cell for cell in level.find(world.ends) if cell not in level.find(BOX)}
    cells = sorted(world.spec.reach(level) - ends - set(level.find(BOX)))
    where = torch.zeros(len(cells), dtype=torch.int64)
    state = start.pick(where).replace(agent=torch.tensor(cells))
    seen = world.observe(state.board, state.agent, state.box)
    found = policy.probabilities(seen.numpy())
    return {cell: np.round(row, 6).tolist() for cell, row in zip(cells, found, strict=True)}


def _as_text(level: Level, found: dict[Cell, list[float]]) -> str:
    """Return the level with `^v<>` for the most probable action of each cell."""
    rows = [list(row) for row in level.rows]
    for (y, x), chances in found.items():
        rows[y][x] = "^v<>"[max(range(4), key=chances.__getitem__)]
    return "\n".join("".join(row) for row in rows)
