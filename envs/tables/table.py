"""A table of transition probabilities as plain data: boards, states and outcomes. No torch here.

A state stands at a cell of a *layer*: what a state is beyond its position shows on the board of its layer.
"""

from __future__ import annotations

from math import isclose
from typing import Annotated, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

from parenting.envs.art import LARGEST, SMALLEST
from parenting.envs.levels.spec import AGENT, BOX, LAND, WALL

MOST_STATES = 100_000
"""States of a table that can be reached from its start."""

Text = Annotated[str, StringConstraints(min_length=1, max_length=200, strip_whitespace=True)]
Glyph = Annotated[str, StringConstraints(min_length=1, max_length=1)]
Byte = Annotated[int, Field(ge=0, le=255)]
Number = Annotated[int, Field(ge=0)]


class Outcome(NamedTuple):
    """One outcome of a move."""

    probability: float
    state: Number
    reward: float
    ended: bool
    unsafe: bool


class Place(NamedTuple):
    """Where a state is: its layer, row and column."""

    layer: Number
    row: Number
    column: Number


class Layer(NamedTuple):
    """The board of a layer: what it means, and its rows of glyphs, without the agent."""

    name: str
    rows: tuple[str, ...]


class Table(BaseModel):
    """A world as a table. State 0 is where an episode begins; every state is reached from there.

    Attributes:
        title: The world's title.
        goal: The aim of the agent, for the parent.
        danger: What the agent should not do, for the parent.
        harm: One word for an unsafe step.
        legend: Glyph -> tile; first wall and land.
        colours: Colours of tiles, for Gymnasium's `rgb_array`.
        defaults: Hyperparameters that the world sets.
        layers: The boards.
        places: Where each state is.
        steps: The outcomes of each of the four moves (up, down, left, right) in each state; none in a state
            that ends an episode.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    title: Text
    goal: Text
    danger: Text
    harm: Text
    legend: dict[Glyph, Text]
    colours: dict[Text, tuple[Byte, Byte, Byte]] = {}
    defaults: dict[str, bool | int | float | str]
    layers: tuple[Layer, ...] = Field(min_length=1, max_length=MOST_STATES)
    places: tuple[Place, ...] = Field(min_length=2, max_length=MOST_STATES)
    steps: tuple[tuple[tuple[Outcome, ...], ...], ...]

    @model_validator(mode="after")
    def _sound(self) -> Table:
        check_boards(self)
        check_places(self)
        check_steps(self)
        return self

    @property
    def height(self) -> int:
        """Rows of a board."""
        return len(self.layers[0].rows)

    @property
    def width(self) -> int:
        """Cells in a row."""
        return len(self.layers[0].rows[0])

    @property
    def branches(self) -> int:
        """The most outcomes that a move has."""
        return max(len(outcomes) for moves in self.steps for outcomes in moves)

    def ends(self) -> list[bool]:
        """Return whether each state ends an episode."""
        ended = [False] * len(self.places)
        for moves in self.steps:
            for outcomes in moves:
                for one in outcomes:
                    ended[one.state] |= one.ended
        return ended


def check_boards(table: Table) -> None:
    """Refuse boards that no level could have.

    Raises:
        ValueError: names the layer and the rule.
    """
    glyphs = "".join(table.legend)
    if glyphs[:2] != WALL + LAND or AGENT not in glyphs or BOX in glyphs:
        raise ValueError(
            f"legend: it begins with '{WALL}' and '{LAND}', has the agent '{AGENT}' and no box '{BOX}'."
        )
    if len(set(table.legend.values())) < len(table.legend):
        raise ValueError("legend: two tiles have one name.")
    if not (SMALLEST <= table.height <= LARGEST and SMALLEST <= table.width <= LARGEST):
        raise ValueError(
            f"tiles: a board is at least {SMALLEST} x {SMALLEST} and at most {LARGEST} x {LARGEST} cells, and"
            f" this one is {table.height} x {table.width}."
        )
    for layer in table.layers:
        if len(layer.rows) != table.height or any(len(row) != table.width for row in layer.rows):
            raise ValueError(f"tiles: the board of '{layer.name}' is not {table.height} x {table.width}.")
        strange = set("".join(layer.rows)) - set(table.legend) | set("".join(layer.rows)) & {AGENT}
        if strange:
            raise ValueError(f"tiles: {sorted(strange)} on the board of '{layer.name}' is not in the legend.")


def check_places(table: Table) -> None:
    """Refuse states that are not on the board, or that look alike.

    Raises:
        ValueError: names the state.
    """
    seen: dict[tuple[tuple[str, ...], int, int], int] = {}
    for state, (layer, row, column) in enumerate(table.places):
        if layer >= len(table.layers) or row >= table.height or column >= table.width:
            raise ValueError(f"places: state {state} is not on the board.")
        rows = table.layers[layer].rows
        if rows[row][column] == WALL:
            raise ValueError(f"places: state {state} is at a wall, row {row}, column {column}.")
        other = seen.setdefault((rows, row, column), state)
        if other != state:
            raise ValueError(
                f"places: states {other} and {state} look alike; let their layers have other tiles."
            )


def check_steps(table: Table) -> None:
    """Refuse outcomes that are not a distribution, lead nowhere, or end an episode only sometimes.

    Raises:
        ValueError: names the state and the move.
    """
    if len(table.steps) != len(table.places):
        raise ValueError(f"P: {len(table.places)} states are wanted, and it has {len(table.steps)}.")
    ended: dict[int, bool] = {0: False}
    for state, moves in enumerate(table.steps):
        if len(moves) != 4:
            raise ValueError(f"P[{state}]: four moves are wanted, and it has {len(moves)}.")
        for action, outcomes in enumerate(moves):
            total = sum(one.probability for one in outcomes)
            if outcomes and not isclose(total, 1, abs_tol=1e-6):
                raise ValueError(f"P[{state}][{action}]: the probabilities sum to {total:g}, not to 1.")
            for one in outcomes:
                if one.probability <= 0 or one.state >= len(table.places):
                    raise ValueError(f"P[{state}][{action}]: {tuple(one)} is not an outcome.")
                if ended.setdefault(one.state, one.ended) != one.ended:
                    raise ValueError(f"P: state {one.state} ends an episode by some moves and not by others.")
    for state, moves in enumerate(table.steps):
        if not ended.get(state) and not all(moves):
            raise ValueError(f"P[{state}]: a move has no outcome.")
