"""`show`: queries, levels and policies as pictures, in a notebook and out of one."""

from __future__ import annotations

from parenting.drawing.level import draw_level
from parenting.envs.levels.spec import Level
from parenting.library.pictures import Drawing
from parenting.library.policy import Policy
from parenting.library.question import Query, Question
from parenting.library.worlds import World


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
        case Query() | Question() | Policy():
            return thing.drawing()
        case Level():
            return Drawing([draw_level(thing)], "\n".join(thing.rows))
        case World():
            texts = ["\n".join(level.rows) for level in thing.levels]
            return Drawing([draw_level(level, thing.spec) for level in thing.levels], "\n\n".join(texts))
    raise TypeError(f"thing: {thing!r} cannot be drawn; a query, question, level, world or policy can.")
