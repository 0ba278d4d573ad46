"""Specify a world without running a rule: its names, its levels and the errors that refuse one. No torch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module

Cell = tuple[int, int]
"""Row and column, counted from 0 at the top left."""

Setting = bool | int | float | str
"""The value of one field of a config."""

Colour = tuple[int, int, int]
"""Red, green and blue, from 0 to 255."""

AGENT = "A"
BOX = "X"
WALL = "#"
GOAL = "G"
LAND = " "
PIECES = AGENT + BOX
"""The glyphs of things that move: they stand on a cell, and land lies under them at the start."""


class LevelError(ValueError):
    """A level is wrong: one sentence with source, line and column (counted from 1) and the rule it breaks."""

    def __init__(self, source: str, line: int, column: int, rule: str) -> None:
        self.source, self.line, self.column, self.rule = source, line, column, rule
        super().__init__(f"{source}, line {line}, column {column}: {rule}.")


@dataclass(frozen=True)
class Level:
    """One level of a world: rows of glyphs of one length, `A` among them (docs/paper.md, "Levels")."""

    name: str
    world: str
    rows: tuple[str, ...]
    header: Mapping[str, str] = field(default_factory=dict, hash=False)  # without world and name
    source: str = field(default="level", compare=False)  # where the text came from, for errors
    line: int = field(default=1, compare=False)  # the text's line that holds the first row
    places: Mapping[str, Cell] = field(default_factory=dict, compare=False)  # line, column of header values
    said: tuple[str, ...] = field(default=(), compare=False)  # what was cut from a person's text

    @property
    def height(self) -> int:
        """Rows."""
        return len(self.rows)

    @property
    def width(self) -> int:
        """Cells in a row."""
        return len(self.rows[0])

    @property
    def text(self) -> str:
        """The level with its header, as `envs.registry.level` reads it."""
        header = {"world": self.world, "name": self.name, **self.header}
        lines = [f"{key}: {value}" for key, value in header.items()]
        return "\n".join([*lines, "", *self.rows]) + "\n"

    def glyph(self, cell: Cell) -> str:
        """Return the glyph at a cell."""
        return self.rows[cell[0]][cell[1]]

    def find(self, glyphs: str) -> list[Cell]:
        """The cells that show any of these glyphs, row by row."""
        return [(y, x) for y, row in enumerate(self.rows) for x, glyph in enumerate(row) if glyph in glyphs]

    def _repr_html_(self) -> str:
        """The level as a notebook shows it. Named as a string, as rules are: drawing is a layer above."""
        shown: str = import_module("parenting.library.show").show(self)._repr_html_()
        return shown

    def wrong(self, cell: Cell, rule: str) -> LevelError:
        """The error that refuses this level for breaking `rule` at a cell."""
        return LevelError(self.source, self.line + cell[0], cell[1] + 1, rule)

    def wrong_header(self, key: str, place: int, rule: str) -> LevelError:
        """The error that refuses this level for what stands at a place in a header's value, counted from 0.

        A level that was not read from a text has no such line; then the art's first cell is named.
        """
        if key not in self.places:
            return self.wrong((0, 0), rule)
        line, column = self.places[key]
        return LevelError(self.source, line, column + place, rule)


@dataclass(frozen=True)
class Brief:
    """The parent's instructions in plain words: the aim of the agent, and the danger."""

    goal: str
    danger: str


@dataclass(frozen=True)
class WorldSpec:
    """A world of the registry: all that can be said of it without running a rule."""

    name: str
    title: str
    rules: str  # "module:class" of the rules in tensors, resolved on use
    legend: Mapping[str, str]  # glyph -> tile; its order gives the codes: 0 wall, 1 land, then the rest
    levels: Mapping[str, str]  # name -> text of the built-in levels; the first is the default
    brief: Brief
    defaults: Mapping[str, Setting]  # fields of agent.config.Config that this world sets
    validate: Callable[[Level], None]  # raises LevelError where a level breaks a rule of this world
    reach: Callable[[Level], set[Cell]]  # every cell that the agent can come to, by the plain search
    keys: tuple[str, ...] = ()  # what a level's header may say besides world and name
    options: Mapping[str, object] = field(default_factory=dict)  # the rules' own settings and their defaults
    colours: Mapping[str, Colour] = field(
        default_factory=dict
    )  # of tiles that `envs.gym_render.PALETTE` has not
    harm: str = "harm"  # one word for what a safe path never does (`Gridworld.forbidden`), for counts

    def __repr__(self) -> str:
        """Return a short text that names the world."""
        return f"<WorldSpec: {self.name}>"

    @property
    def glyphs(self) -> str:
        """The glyphs in the order of their codes."""
        return "".join(self.legend)

    @property
    def default(self) -> str:
        """The name of the level taken when none is named."""
        return next(iter(self.levels))

    @property
    def ends_at_goal(self) -> bool:
        """True if there is a goal; without one no policy is optimal (docs/paper.md, "Optimal")."""
        return GOAL in self.legend


def maze_legend(glyphs: str) -> str:
    """The glyphs of a world and of its mazes (Sec. 3.1.1): a world without a goal gets one behind its own."""
    return glyphs if GOAL in glyphs else glyphs + GOAL
