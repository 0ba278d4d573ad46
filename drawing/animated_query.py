"""Draw a query and its answer as a moving picture (SVG): the clips play, then the answer lights up."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

from parenting.drawing.board import Board
from parenting.drawing.clip import Clip
from parenting.drawing.query import GAP, PADDING, layout
from parenting.drawing.query_view import query_view
from parenting.drawing.render import standalone
from parenting.drawing.trail import Point
from parenting.envs import registry
from parenting.envs.levels.spec import Level, WorldSpec

LEAD, STEP, THOUGHT, REST = 900, 600, 700, 2600
"""Milliseconds before the first step, of a step, from the last step to the answer, and after it."""
MOVING = 0.85
"""The part of a step during which a piece moves."""
BUTTON = 54
"""The height of a button in pixels."""
CHOICES = (("left", "←"), ("right", "→"), ("either", "E"), ("neither", "N"))
"""The answers, each with the key that gives it."""

Moment = tuple[float, str]
"""Milliseconds from the start, and the declaration that holds then."""


def animate_query(
    clips: Mapping[str, Clip],
    level: Level,
    kind: str,
    choice: str,
    stage: int = 1,
    spec: WorldSpec | None = None,
) -> str:
    """Return a query and its answer as the text of an SVG file whose pieces move.

    Where motion is unwanted (`prefers-reduced-motion`) it stands still, with trails, cues and the answer.

    Args:
        clips: The clips by side, as `parenting.drawing.query_tensors.read_clips` returns them.
        level: The level on which they were recorded.
        kind: "guidance" (Sec. 2.1) or "preference" (Sec. 2.2).
        choice: The answer: "left", "right", "either" or "neither".
        stage: The maturity T of the query. A clip of fewer steps has ended early.
        spec: The level's world. By default it is the registered world of that name.

    Raises:
        UnknownWorldError: `spec` is missing and no world of this name is registered.
    """
    spec = spec or registry.spec(level.world, level)
    view = query_view(clips, kind, stage, spec.legend, level.rows)
    place = layout(view)
    steps = max(side.board.steps for side in view.sides)
    answered = LEAD + STEP * steps + THOUGHT
    total = answered + REST
    motion = [_moving(side.name, side.board, total) for side in view.sides]
    motion.append(_rule(".answer", "answer", _shown(answered, total, 250), total))
    return standalone(
        "question.svg",
        legend=spec.legend,
        view=view,
        place=place,
        choice=choice,
        chosen=("left", "right") if choice == "either" else (choice,),
        buttons=_buttons(place.width, place.height),
        height=place.height + BUTTON + PADDING,
        motion="\n".join(motion),
    )


def _buttons(width: int, y: int) -> list[tuple[str, str, int, int, int, int]]:
    """Name, key, x, y, width and height of each button."""
    wide = (width - 2 * PADDING - 3 * GAP // 2) // 4
    return [
        (name, key, PADDING + number * (wide + GAP // 2), y, wide, BUTTON)
        for number, (name, key) in enumerate(CHOICES)
    ]


def _moving(side: str, board: Board, total: int) -> str:
    """The rules that move one board's pieces, and show each cue from the moment at which it happens."""
    rules = [_rule(f".{side} .agent", f"{side}-agent", _way(board.agent.at), total)]
    if board.box:
        rules.append(_rule(f".{side} .box", f"{side}-box", _way(board.box.at), total))
    for frame in sorted({cue.frame for cue in board.cues if cue.frame}):
        moments = _shown(LEAD + STEP * (frame - 1 + MOVING), total, 1)
        rules.append(_rule(f'.{side} .cue[data-from="{frame}"]', f"{side}-{frame}", moments, total))
    return "\n".join(rules)


def _way(at: Sequence[Point]) -> list[Moment]:
    """A piece rests at every centre, and moves from one to the next."""
    moments: list[Moment] = [(0, _at(at[0]))]
    for step, (here, there) in enumerate(pairwise(at)):
        start = LEAD + STEP * step
        if here != there:
            moments += [(start, _at(here)), (start + MOVING * STEP, _at(there))]
    return [*moments, (-1, _at(at[-1]))]


def _at(point: Point) -> str:
    return f"transform:translate({point[0]:g}px,{point[1]:g}px)"


def _shown(moment: float, total: int, fade: int) -> list[Moment]:
    """Hidden until a moment, and there from then on."""
    there = min(moment + fade, total)
    return [(0, "opacity:0"), (moment, "opacity:0"), (there, "opacity:1"), (-1, "opacity:1")]


def _rule(selector: str, name: str, moments: Iterable[Moment], total: int) -> str:
    """An animation without end; a moment of -1 is the end of the round."""
    parts = ((1 if moment < 0 else moment / total, declaration) for moment, declaration in moments)
    frames = "".join(f"{100 * part:.4g}%{{{declaration}}}" for part, declaration in parts)
    return f"@keyframes {name}{{{frames}}}\n{selector}{{animation:{name} {total}ms ease-in-out infinite}}"
