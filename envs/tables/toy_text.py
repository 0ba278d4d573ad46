"""Gymnasium's toy text, read off its environments: tiles, danger, goal. No torch."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

LAKE, CLIFF, TAXI = "FrozenLakeEnv", "CliffWalkingEnv", "TaxiEnv"
FALL = -100
"""The reward by which CliffWalking tells a fall."""
WEST, EAST = 3, 2  # of Taxi's actions


def read_toy_text(env: Any, name: str | None, seed: int) -> dict[str, Any]:
    """Return the arguments of `TableWorld` for an environment.

    Raises:
        ValueError: it is none of the three, or its table does not tell all of it.
    """
    bare = env.unwrapped
    readers: dict[str, Callable[[Any, int], dict[str, Any]]] = {LAKE: _lake, CLIFF: _cliff, TAXI: _taxi}
    kind = type(bare).__name__
    if kind not in readers:
        raise ValueError(
            f"env: {kind} is none of FrozenLake, CliffWalking and Taxi."
            " Give its table to pt.TableWorld(P, ...)."
        )
    found = {"P": bare.P, **readers[kind](bare, seed)}
    return found if name is None else {**found, "name": name}


def _lake(bare: Any, seed: int) -> dict[str, Any]:
    rows = _rows(bare.desc)
    slippery = any(len(outcomes) > 1 for moves in bare.P.values() for outcomes in moves.values())
    return {
        "shape": (len(rows), len(rows[0])),
        "tiles": [row.replace("S", " ").replace("F", " ").replace("H", "W") for row in rows],
        "legend": {" ": "ice", "W": "hole"},
        "unsafe": "W",
        "goal": "G",
        "start": _start(bare, seed),
        "moves": (3, 1, 0, 2),
        "name": "frozen-lake-slippery" if slippery else "frozen-lake",
        "title": "Frozen Lake",
        "aim": "The agent should walk over the ice to the goal.",
        "danger": "Holes: an agent that falls into one is lost, and the episode ends.",
        "harm": "hole",
        "colours": {"ice": (214, 234, 248), "hole": (20, 60, 120)},
    }


def _cliff(bare: Any, seed: int) -> dict[str, Any]:
    rows, columns = (int(size) for size in bare.shape)
    entered = {one[1] for moves in bare.P.values() for outcomes in moves.values() for one in outcomes}
    ends = {one[1] for moves in bare.P.values() for outcomes in moves.values() for one in outcomes if one[3]}
    start = _start(bare, seed)
    drawn = [" " if s in entered or s == start else "W" for s in range(rows * columns)]
    slippery = bool(getattr(bare, "is_slippery", False))
    return {
        "shape": (rows, columns),
        "tiles": ["".join(drawn[row * columns : (row + 1) * columns]) for row in range(rows)],
        "legend": {"W": "cliff"},
        "unsafe": _falls,
        "goal": {int(state) for state in ends},
        "start": start,
        "moves": (0, 2, 3, 1),
        "name": "cliff-walking-slippery" if slippery else "cliff-walking",
        "title": "Cliff Walking",
        "aim": "The agent should walk to the goal.",
        "danger": "The cliff: an agent that falls is put back to where it began.",
        "harm": "fall",
        "colours": {"cliff": (90, 60, 40)},
    }


def _falls(_state: int, _move: int, _after: int, reward: float) -> bool:
    return reward <= FALL


def _taxi(bare: Any, seed: int) -> dict[str, Any]:
    """The map as it is drawn, with walls between columns: a move to the side is two columns wide.

    Raises:
        ValueError: the passenger changes their mind, which the table does not tell.
    """
    if getattr(bare, "fickle_passenger", False):
        raise ValueError("env: a fickle passenger is not told by Taxi's table; leave fickle_passenger out.")
    start, waiting = _start(bare, seed), len(bare.locs)
    depots = [(int(row), int(column)) for row, column in bare.locs]
    walls = str.maketrans({":": " ", "|": "#", "+": "#", "-": "#", **dict.fromkeys("RGBY", " ")})
    ground = [row.translate(walls) for row in _rows(bare.desc)]
    to = _place(depots[_state(bare, start)[3]])
    tiles: dict[Any, list[str]] = {"the passenger rides": _drawn(ground, to, "G")}
    for depot in depots:
        named = f"the passenger waits at row {depot[0] + 1}, column {depot[1] + 1}"
        tiles[named] = _drawn(_drawn(ground, to, "D"), _place(depot), "p")
    names = list(tiles)

    def place(state: int) -> tuple[int, int, Any]:
        row, column, passenger, destination = _state(bare, state)
        arrived = passenger in (waiting, destination)
        return *_place((row, column)), names[0] if arrived else names[1 + passenger]

    def then(state: int) -> int | None:
        """The passenger gets in where they wait, and out where they want to."""
        row, column, passenger, destination = _state(bare, state)
        if passenger < waiting:
            return 4 if passenger != destination and (row, column) == depots[passenger] else None
        return 5 if (row, column) == depots[destination] else None

    return {
        "shape": (len(ground), len(ground[0])),
        "tiles": tiles,
        "legend": {"p": "passenger", "D": "destination", " ": "street"},
        "goal": "G",
        "start": start,
        "moves": (1, 0, WEST, EAST),
        "then": then,
        "place": place,
        "name": "taxi",
        "title": "Taxi",
        "aim": "The taxi should fetch the passenger and take them to their destination.",
        "danger": "None; but each move takes time.",
        "colours": {"street": (235, 235, 235), "passenger": (0, 114, 178), "destination": (230, 159, 0)},
    }


def _drawn(rows: list[str], cell: tuple[int, int], glyph: str) -> list[str]:
    row, column = cell
    return [line[:column] + glyph + line[column + 1 :] if y == row else line for y, line in enumerate(rows)]


def _place(cell: tuple[int, int]) -> tuple[int, int]:
    """Where a cell of Taxi is on its map."""
    return 1 + cell[0], 1 + 2 * cell[1]


def _state(bare: Any, state: int) -> tuple[int, int, int, int]:
    row, column, passenger, destination = (int(part) for part in bare.decode(state))
    return row, column, passenger, destination


def _rows(desc: Any) -> list[str]:
    return [b"".join(row).decode("ascii") for row in desc.tolist()]


def _start(bare: Any, seed: int) -> int:
    """The state in which episodes begin: the only one, or that of an episode of this seed."""
    able = [state for state, chance in enumerate(bare.initial_state_distrib) if chance > 0]
    return able[0] if len(able) == 1 else int(bare.reset(seed=seed)[0])
