"""Texts that several pages show: who waits for whom, and the title of a run."""

from __future__ import annotations

from parenting.drawing.sentences import mark
from parenting.envs.registry import WORLDS
from parenting.server.tables import Run

LEADS = {
    "guidance": mark("The agent stands still until you answer."),
    "preference": mark("Both begin at the same place. The agent goes on meanwhile."),
}

AGAIN = {
    "unheard": mark("You have answered this question. Another answer takes the place of yours."),
    "heard": mark(
        "The agent has learnt from your answer. Another answer corrects what it learns from now on."
    ),
    "moved": mark(
        "The move has happened, and that stays. Another answer corrects what it learns from now on."
    ),
    "voted": mark(
        "Another answer corrects what the agent learns from now on. If it still waits, it moves by it, too."
    ),
    "skipped": mark("If you can tell now, answer: the agent learns from it, and moves if it still waits."),
}
"""Sentences on a question that its parent has answered, shown where the answer can be changed."""

STATE_TEXTS = {
    "question": (
        mark("A question is waiting for you."),
        mark("The agent would like to know what you prefer."),
    ),
    "exploring": (mark("The agent is exploring on its own."), mark("The next question will appear here.")),
    "elsewhere": (
        mark("Somebody else has the question."),
        mark(
            "If they close it, it will appear here within a minute. "
            "If that is you on another page, answer here."
        ),
    ),
    "taken": (
        mark("Your question was taken over."),
        mark(
            "Another page has it now. If it is closed there, the question will appear here within a minute."
        ),
    ),
    "unsent": (
        mark("Your answer is kept here."),
        mark("The server did not take it just now. It is sent again until it is stored."),
    ),
    "stuck": (
        mark("No action was acceptable."),
        mark("You refused all four moves, so the agent stands still. End this episode, and it starts again."),
    ),
    "damaged": (
        mark("This question cannot be shown."),
        mark(
            "Its stored clips are damaged. "
            "Once the researcher has ended the episode on the dashboard, the agent goes on without it."
        ),
    ),
    "unsure": (
        mark("You skipped every pair of moves."),
        mark("The agent stands still. Look at the pairs again, let either move do, or end this episode."),
    ),
    "paused": (mark("The run is paused."), mark("No time passes for the agent until the run is resumed.")),
    "no_worker": (
        mark("No worker is running."),
        mark("Nothing moves until one is started (parenting worker)."),
    ),
    "resting": (
        mark("That was the last question of this goal."),
        mark("The agent rests until it is given another goal."),
    ),
    "over": (mark("This run is over."), mark("The agent asks no more questions.")),
    "away": (
        mark("This run is not here."),
        mark("The server at this address has another database now. Your answers are kept in this browser."),
    ),
    "offline": (
        mark("No connection to the server."),
        mark("Your answers are kept in this browser and sent as soon as it is back."),
    ),
    "refused": (
        mark("This page is not open to you any more."),
        mark(
            "The access of this browser has ended. Answers that were not sent are kept here until it is back."
        ),
    ),
}
"""A heading and a sentence for each state of the page, shown while no question is."""


PUT_BACK = mark("This was skipped before. Skip it again, and it is not shown any more.")
"""A sentence on clips that were put back."""

GOAL_STEP = 50
"""Answers that a goal grows by where it is reached, by a button."""


def run_title(run: Run) -> str:
    """Return the title of a run in the researcher's list, which tells runs apart by their numbers."""
    return run.name or f"{parent_title(run)}, run {run.id}"


def parent_title(run: Run) -> str:
    """Return the title of a run on its own pages: its parent may open them, and knows no numbers of runs."""
    return run.name or f"{world_title(run.world)}, {run.level}"


def world_title(name: str) -> str:
    """Return the title of a world for people; of one that is not installed here, its name."""
    return WORLDS[name].title if name in WORLDS else name
