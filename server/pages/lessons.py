"""The questions of the practice page: what each is for, and what every answer to it means.

They are asked on a small island of the world Unsafe Exploration, and drawn as all questions are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from parenting.drawing.clip import Cell, Clip
from parenting.drawing.sentences import mark
from parenting.drawing.walk import walk
from parenting.envs import registry
from parenting.envs.levels.spec import Level

WORLD = "unsafe-exploration"
POND: Level = registry.level(
    WORLD,
    "\n".join(
        (
            "WWWWWWW",
            "W  A  W",
            "W     W",
            "W   G W",
            "WWWWWWW",
            "",
        )
    ),
    "the practice island",
)


@dataclass(frozen=True)
class Lesson:
    """One question, its task, and what is said to each answer."""

    kind: str  # guidance or preference
    start: Cell
    left: tuple[str, ...]  # the actions of the left clip, or the move A
    right: tuple[str, ...]
    task: str
    best: str  # the choice that is right
    said: Mapping[str, str]  # to each choice
    undo: bool = False  # the answer is to be taken back once

    @property
    def clips(self) -> dict[str, Clip]:
        """The two clips, as the record of a run holds them."""
        return {
            name: walk(POND, actions, self.start)
            for name, actions in (("left", self.left), ("right", self.right))
        }

    @property
    def stage(self) -> int:
        """The stage T of the question: the length of its clips."""
        return max(len(self.left), len(self.right))


LESSONS = (
    Lesson(
        "guidance",
        (1, 3),
        ("up",),
        ("down",),
        mark(
            "The agent, the orange disc, is to reach the green flag. In the water it drowns. "
            "It asks before it moves: which of the two arrows is better?"
        ),
        "right",
        {
            "left": mark(
                "Not this one: in the water the agent drowns. B leads over land, nearer to the flag."
            ),
            "right": mark("Right. B leads over land, nearer to the flag; A leads into the water."),
            "either": mark("Not quite. Either says that both are equally good; A leads into the water."),
            "neither": mark(
                "Not quite. Neither says that both are too dangerous, and B is safe. B is better."
            ),
        },
    ),
    Lesson(
        "guidance",
        (2, 2),
        ("right",),
        ("down",),
        mark(
            "Both moves are safe, and both lead one step nearer to the flag. "
            "If you find neither of two moves better, the answer is Either."
        ),
        "either",
        {
            "left": mark("You may say so. But B is as good, and Either tells the agent just that."),
            "right": mark("You may say so. But A is as good, and Either tells the agent just that."),
            "either": mark("Right. Both lead one step nearer to the flag, so the agent may take either."),
            "neither": mark(
                "Not quite. Neither keeps the agent from both moves, and both are safe. Say Either."
            ),
        },
    ),
    Lesson(
        "guidance",
        (1, 1),
        ("up",),
        ("left",),
        mark(
            "Now both moves lead into the water. If both are too dangerous, the answer is Neither: the agent "
            "stays where it is, and asks about other moves."
        ),
        "neither",
        {
            "left": mark("The agent would go up and drown. If both moves are too dangerous, say Neither."),
            "right": mark("The agent would go left and drown. If both moves are too dangerous, say Neither."),
            "either": mark("It would take one of them, and drown. Equally bad is not harmless: say Neither."),
            "neither": mark("Right. The agent takes neither, and would ask you about down and right next."),
        },
    ),
    Lesson(
        "preference",
        (1, 3),
        ("right", "right", "right"),
        ("down", "down", "right"),
        mark(
            "Now the agent shows two short clips of what it did. They begin at the same place. "
            "Which one should it do more often?"
        ),
        "right",
        {
            "left": mark("Not this one: it ends in the water. The right clip reaches the flag."),
            "right": mark("Right. It reaches the flag over land; the left clip ends in the water."),
            "either": mark("Not quite. The right clip reaches the flag, the left one ends in the water."),
            "neither": mark(
                "Not quite. Neither teaches nothing about clips, and the right one reaches the flag."
            ),
        },
    ),
    Lesson(
        "guidance",
        (2, 5),
        ("left",),
        ("right",),
        mark(
            "Fingers slip. Give any answer here, then take it back with the button Undo, or with the key Z."
        ),
        "left",
        {
            "left": mark("Right. A leads nearer to the flag, and B into the water."),
            "right": mark(
                "B leads into the water: that is an answer to take back. A leads nearer to the flag."
            ),
            "either": mark(
                "B leads into the water, so the two are not equally good. A leads nearer to the flag."
            ),
            "neither": mark("A is safe, and leads nearer to the flag. It is the better answer."),
        },
        undo=True,
    ),
)
"""The questions, in their order."""

TAKE_BACK = mark("Now take it back: press Undo below, or the key Z.")
TAKEN_BACK = mark("You took your answer back, and here is the question again. Answer it once more.")
