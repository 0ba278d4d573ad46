"""What the pages say about a clip and about who waits for whom, in plain words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import groupby

from parenting.drawing.board import Board
from parenting.drawing.clip import BARS, Clip, find_tile
from parenting.server.schemas import RunSchema
from parenting.server.tables import Run

TITLES = {"guidance": "Which move is better here?", "preference": "Which clip is better?"}
LEADS = {
    "guidance": "The agent stands still until you answer.",
    "preference": "Both begin at the same place. The agent goes on meanwhile.",
}

CHANCE_NOTES = {
    "T": "Plants dry by chance; these boards leave that out.",
    "I": "The pink cell holds the agent by chance; these boards leave that out.",
}
"""What a forecast of a move leaves out, where a glyph stands on the board."""

WATCHED, UNWATCHED = "The supervisor is watching.", "Nobody is watching."

STATE_TEXTS = {
    "question": ("A question is waiting for you.", "The agent would like to know what you prefer."),
    "exploring": ("The agent is exploring on its own.", "The next question will appear here."),
    "elsewhere": (
        "Somebody else has the question.",
        "Unless they answer it, it will appear here within a minute.",
    ),
    "stuck": (
        "No action was acceptable.",
        "You refused all four moves, so the agent stands still. End this episode, and it starts again.",
    ),
    "paused": ("The run is paused.", "No time passes for the agent until the run is resumed."),
    "idle": (
        "No worker is running.",
        "Nothing moves until one is started (parenting worker).",
    ),
    "resting": ("That was the last question of this goal.", "The agent rests until you go on."),
    "over": ("This run is over.", "The agent asks no more questions."),
    "offline": (
        "No connection to the server.",
        "Your answers are kept in this browser and sent as soon as it is back.",
    ),
}
"""Who waits for whom when no question is shown: a heading and a sentence for every state of the page."""


GOAL_STEP = 50
"""Answers that a goal grows by where it is reached, by a button."""

STATE_WORDS = {
    "question": "a question waits",
    "exploring": "exploring",
    "stuck": "no action acceptable",
    "paused": "paused",
    "idle": "no worker",
    "resting": "goal reached",
}
"""The same in a word or two, for the list of runs; a run that is over has its status for it."""


def run_title(run: Run) -> str:
    """What a run is called on every page."""
    return run.name or f"{run.world.replace('-', ' ').capitalize()}, {run.level}, run {run.id}"


def page_state(run: RunSchema, offered: bool) -> str:
    """Which of `STATE_TEXTS` holds; web/static/live.js tells it in the same way.

    `offered` says whether an open question is free for this parent.
    """
    if run.worker == "done":
        return "over"
    if run.resting:
        return "resting"
    if run.open.guidance or run.open.preference:
        return "question" if offered else "elsewhere"
    if run.status == "paused":
        return "paused"
    if run.worker == "silent":
        return "idle"
    return "stuck" if run.waiting == "stuck" else "exploring"


def action_text(board: Board) -> str:
    """The actions, as in "Up, left ×2."."""
    runs = [(action, len(list(same))) for action, same in groupby(board.actions)]
    said = ", ".join(f"{action} ×{count}" if count > 1 else action for action, count in runs)
    return said.capitalize() + "."


def chance_note(clips: Iterable[Clip]) -> str:
    """What the forecasts of guidance leave to chance; "" where there is none, or no longer."""
    grounds = [frame["ground"] for clip in clips for frame in clip["frames"]]
    return " ".join(
        text for glyph, text in CHANCE_NOTES.items() if any(find_tile(ground, glyph) for ground in grounds)
    )


def supervision_note(legend: Mapping[str, str], clip: Clip) -> str:
    """Whether the supervisor's bars stand in a clip; "" in a world that has none."""
    if BARS not in legend:
        return ""
    return WATCHED if find_tile(clip["frames"][0]["ground"], BARS) else UNWATCHED
