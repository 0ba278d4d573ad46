"""`pt.TableWorld`: a world from a table of transition probabilities. Nothing here loads torch."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from typing import Any, Self

from pydantic import ValidationError

from parenting.envs.art import parse
from parenting.envs.levels.spec import Colour, Level, Setting, WorldSpec
from parenting.envs.tables.layers import lay_out
from parenting.envs.tables.table import Table
from parenting.envs.tables.text import pack, spec_of
from parenting.envs.tables.transitions import Transitions, Unsafe, harmful, numbered, reached, states_of

MOVES = (0, 1, 2, 3)
DEFAULTS: dict[str, Setting] = {"gamma": 0.95, "max_episode_steps": 100, "pretrain": False}


class TableWorld:
    """A world given by a table of transition probabilities, such as those of Gymnasium's toy text.

    Agents are raised in it as in any other world: `pt.train(world)`, and by a person on the page with
    `parent=pt.Person()`. Its table is part of its level, so a run that is stored holds its whole world. An
    entry point of the group `parenting.worlds` may name it (docs/worlds.md).

    What a state is beyond its position becomes a *layer* with a board of its own. Where a move has several
    outcomes, chance is drawn by the trial's key, so that a life can be replayed; the forecast of a question
    is the likeliest outcome, and says how probable it is.

    Args:
        P: `P[state][action]` is a list of outcomes (probability, next state, reward, terminated).
        shape: Rows and columns.
        tiles: Rows of glyphs, one a cell; or, by layer, such rows. None is land everywhere.
        unsafe: What a safe agent never does: entering these glyphs, entering these states, or a function of
            (state, move, next state, reward).
        goal: Glyphs of the tiles, or the states, at which the agent should arrive. They are drawn as `G`.
        start: The state in which episodes begin.
        moves: The actions of the table that are up, down, left and right.
        then: For tables with more actions: a function of a state that returns the action which happens there
            by itself after a move, or None.
        place: A function of a state that returns its row, column and layer (any name). By default states are
            counted row by row, layer after layer.
        name: The world's name: lower-case words joined by hyphens.
        title: Its title.
        legend: The name of each glyph of `tiles`.
        aim: What the agent should do, for the parent.
        danger: What it should not do, for the parent.
        harm: One word for an unsafe step.
        colours: Colours of tiles by name, for Gymnasium's `rgb_array`.
        defaults: Hyperparameters that the world sets.

    Raises:
        ValueError: The table is not a distribution, a state is not on the board, two states look alike, or a
            name is wrong; the message names it.

    Example:
        >>> import parenting as pt
        >>> P = {s: {a: [(1.0, s, 0.0, False)] for a in range(4)} for s in range(9)}
        >>> for s in range(8):
        ...     P[s][3] = [(1.0, s + 1, 0.0, s == 7)]  # right, and on into the next row
        >>> line = pt.TableWorld(P, shape=(3, 3), goal={8}, name="line")
        >>> pt.train(line, seed=1).mean()["optimal"]
        1.0
    """

    spec: WorldSpec
    table: Table

    def __init__(
        self,
        P: Transitions,
        shape: tuple[int, int],
        *,
        tiles: Sequence[str] | Mapping[Any, Sequence[str]] | None = None,
        unsafe: Unsafe = (),
        goal: str | Collection[int] = (),
        start: int = 0,
        moves: tuple[int, int, int, int] = MOVES,
        then: Callable[[int], int | None] | None = None,
        place: Callable[[int], tuple[int, int, Hashable]] | None = None,
        name: str = "table",
        title: str | None = None,
        legend: Mapping[str, str] | None = None,
        aim: str = "The agent should walk to the goal.",
        danger: str = "Unsafe steps.",
        harm: str = "unsafe",
        colours: Mapping[str, Colour] | None = None,
        defaults: Mapping[str, Setting] | None = None,
    ) -> None:
        if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
            raise ValueError(
                f"name: '{name}' is not lower-case words joined by hyphens, such as frozen-lake."
            )
        steps, number = reached(P, start, moves, then)
        harms = harmful(unsafe)
        boards = lay_out(shape, tiles, list(number), place, goal, legend or {}, states_of(unsafe))
        try:
            self.table = Table(
                title=title or name.replace("-", " ").title(),
                goal=aim,
                danger=danger,
                harm=harm,
                legend=boards.legend,
                colours=dict(colours or {}),
                defaults={**DEFAULTS, **(defaults or {})},
                layers=boards.layers,
                places=boards.places,
                steps=numbered(steps, number, lambda *step: harms(boards, *step)),
            )
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"]))
            raise ValueError(f"{where} {first['msg']}".strip().removeprefix("Value error, ")) from None
        self.spec = spec_of(name, pack(self.table))

    @classmethod
    def from_toy_text(cls, env: Any, *, name: str | None = None, seed: int = 0) -> Self:
        """Read an environment of Gymnasium's toy text: FrozenLake, CliffWalking or Taxi.

        Args:
            env: The environment, as `gymnasium.make` returns it.
            name: The world's name; None takes the environment's, such as frozen-lake.
            seed: Where episodes may begin in several states (Taxi), they begin where an episode of this seed
                does.

        Returns:
            The world. Taxi's passenger is picked up and put down by itself, where that is what is wanted.

        Raises:
            ValueError: It is another environment, or one whose table does not tell all of it.

        Example:
            >>> import gymnasium
            >>> import parenting as pt
            >>> lake = pt.TableWorld.from_toy_text(gymnasium.make("FrozenLake-v1", is_slippery=False))
            >>> lake
            <TableWorld frozen-lake: 16 states, 1 layer, 6 x 6, nothing left to chance>
        """
        from parenting.envs.tables.toy_text import read_toy_text

        return cls(**read_toy_text(env, name, seed))

    @property
    def level(self) -> Level:
        """The level, which holds the whole table."""
        return parse(self.spec.levels[self.spec.default], self.spec, self.spec.default)

    def __repr__(self) -> str:
        table = self.table
        layers = "1 layer" if len(table.layers) == 1 else f"{len(table.layers)} layers"
        chance = (
            "nothing left to chance" if table.branches == 1 else f"up to {table.branches} outcomes a move"
        )
        size = f"{table.height} x {table.width}"
        return f"<TableWorld {self.spec.name}: {len(table.places)} states, {layers}, {size}, {chance}>"
