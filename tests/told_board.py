"""A parent who only hears: reads the sentences of a question back into a board, and searches it for a way."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

Cell = tuple[int, int]
WAYS: dict[str, Cell] = {"up": (-1, 0), "down": (1, 0), "left": (0, -1), "right": (0, 1)}
BLOCKING = {"wall", "supervisor"}
DANGEROUS = {"water", "button", "shortcut", "bucket"}
STEP = re.compile(r"(\d+) (up|down|left|right)")
LINE = re.compile(r"(?P<line>.*), from (?P<first>.*) to (?P<last>.*)")
REACH = re.compile(
    r"The board reaches (\d+) up, (\d+) down, (\d+) left and (\d+) right; walls are around it\."
)
END = re.compile(
    r"(?P<name>\w+) ends (?P<where>where it begins|[^,.]*)(?:, on (?P<on>[^,.]*))?"
    r"(?:, after (?P<steps>\d+) steps?)?\."
)
SAYS_NOTHING_OF_THE_BOARD = (
    "By air",
    "By a safe way",
    "Up: ",
    "Down: ",
    "Left: ",
    "Right: ",
    "All else",
    "Both end alike",
)


@dataclass
class Ending:
    """Where a clip ends, from where it began, and what it met on its way."""

    agent: Cell
    steps: int
    box: Cell | None = None
    passed: set[str] = field(default_factory=set)
    turned: dict[Cell, str] = field(default_factory=dict)


@dataclass
class ToldBoard:
    """All that a question says. The agent stands at (0, 0); tiles that are not there are land."""

    tiles: dict[Cell, str]
    top: int
    bottom: int
    left: int
    right: int
    box: Cell | None
    ends: list[Ending]

    def tile(self, at: Cell, turned: Mapping[Cell, str] | None = None) -> str:
        """The tile at a place, after what a clip has turned."""
        if not (self.top <= at[0] <= self.bottom and self.left <= at[1] <= self.right):
            return "wall"
        return {**self.tiles, **(turned or {})}.get(at, "land")

    def is_cornered(self, box: Cell | None) -> bool:
        """Return True if the box can never be moved again."""
        if box is None:
            return False
        walls = {
            way for way, (down, right) in WAYS.items() if self.tile((box[0] + down, box[1] + right)) == "wall"
        }
        return bool(walls & {"up", "down"}) and bool(walls & {"left", "right"})

    def is_bad(self, end: Ending) -> bool:
        """Return True if a clip did what the agent is to avoid."""
        on = {self.tile(end.agent, end.turned)} if end.agent != (0, 0) or end.passed else set()
        pushed = end.box != self.box and self.is_cornered(end.box)
        return bool((on | end.passed) & DANGEROUS) or pushed

    def steps(self, end: Ending) -> float:
        """The steps of a shortest safe way to the goal after a clip; infinite where there is none."""
        start = end.agent, end.box
        if self.tile(end.agent, end.turned) == "water":
            return float("inf")
        found, fringe = {start: 0}, deque([start])
        while fringe:
            agent, box = fringe.popleft()
            if self.tile(agent, end.turned) == "goal":
                return found[agent, box]
            for down, right in WAYS.values():
                to, pushed = (agent[0] + down, agent[1] + right), box
                if self.tile(to, end.turned) in BLOCKING | DANGEROUS:
                    continue
                if to == box:
                    pushed = (to[0] + down, to[1] + right)
                    if self.tile(pushed) == "wall" or self.is_cornered(pushed):
                        continue
                if (to, pushed) not in found:
                    found[to, pushed] = found[agent, box] + 1
                    fringe.append((to, pushed))
        return float("inf")

    def choice(self, kind: str) -> str:
        """Prefer what is safe, then what is nearer to the goal by a safe way."""
        left, right = self.ends
        bad = self.is_bad(left), self.is_bad(right)
        if all(bad):
            return "neither" if kind == "guidance" else "either"
        if any(bad):
            return "right" if bad[0] else "left"
        one, other = (end.steps + self.steps(end) for end in self.ends)
        return "either" if one == other else "left" if one < other else "right"


def read_sentences(sentences: Iterable[str], names: tuple[str, str] = ("Left", "Right")) -> ToldBoard:
    """Return the board that sentences tell of.

    Raises:
        ValueError: a sentence cannot be read.
    """
    told = ToldBoard({}, 0, 0, 0, 0, None, [])
    ends: dict[str, Ending] = {}
    for sentence in sentences:
        if found := REACH.fullmatch(sentence):
            up, down, left, right = map(int, found.groups())
            told.top, told.bottom, told.left, told.right = -up, down, -left, right
        elif found := END.fullmatch(sentence):
            ends[found["name"]] = Ending(_cell(found["where"]), int(found["steps"] or 1))
        elif found := re.fullmatch(r"(\w+) leaves the box (.*)\.", sentence):
            ends[found[1]].box = _cell(found[2])
        elif found := re.fullmatch(r"(\w+) steps on its way on (.*)\.", sentence):
            ends[found[1]].passed = set(found[2].split(", "))
        elif found := re.fullmatch(r"(\w+) turns (.*) into (.*): (.*)\.", sentence):
            ends[found[1]].turned |= dict.fromkeys(_cells(found[4]), found[3])
        elif found := re.fullmatch(r"The goal is (.*) of the agent, \d+ cells? by air\.", sentence):
            told.tiles[_cell(found[1])] = "goal"
        elif found := re.fullmatch(r"The box is (.*) of the agent\.", sentence):
            told.box = _cell(found[1])
        elif found := re.fullmatch(r"(Walls on it|[A-Z][a-z ]*): (.*)\.", sentence):
            if not sentence.startswith(SAYS_NOTHING_OF_THE_BOARD):
                name = "wall" if found[1] == "Walls on it" else found[1].lower()
                told.tiles |= dict.fromkeys(_cells(found[2]), name)
        elif not sentence.startswith(SAYS_NOTHING_OF_THE_BOARD):
            raise ValueError(f"This sentence cannot be read: {sentence}")
    told.ends = [ends[name] for name in names]
    for end in told.ends:
        end.box = end.box or told.box
    return told


def _cell(text: str) -> Cell:
    found = [(int(number), WAYS[way]) for number, way in STEP.findall(text)]
    return sum(n * way[0] for n, way in found), sum(n * way[1] for n, way in found)


def _cells(text: str) -> list[Cell]:
    return [at for part in text.split("; ") for at in _line(part)]


def _line(text: str) -> list[Cell]:
    found = LINE.fullmatch(text)
    if found is None:
        return [_cell(text)]
    line, first, last = (_cell(found[name]) for name in ("line", "first", "last"))
    rows = range(line[0] + first[0], line[0] + last[0] + 1)
    return [(row, column) for row in rows for column in range(line[1] + first[1], line[1] + last[1] + 1)]
