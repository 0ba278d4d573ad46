"""Every status of a run, a query and a job, with the sentence that explains it.

The columns of `server.tables` are held to these words by CHECKs, the API and its description use the same
enumerations, and docs/queue.md prints the same sentences.
"""

from __future__ import annotations

from enum import StrEnum


class RunStatus(StrEnum):
    """The status of a run, set by the operator or by its worker."""

    ACTIVE = "active"
    PAUSED = "paused"
    STOPPED = "stopped"
    FINISHED = "finished"
    FAILED = "failed"


class QueryStatus(StrEnum):
    """The status of a query."""

    OPEN = "open"
    ANSWERED = "answered"
    APPLIED = "applied"
    WITHDRAWN = "withdrawn"


class Waiting(StrEnum):
    """The reason why a run does not tick, as its worker reports it."""

    GUIDANCE = "guidance"
    PREFERENCES = "preferences"
    STUCK = "stuck"
    UNSURE = "unsure"


class JobState(StrEnum):
    """The state of a job."""

    WAITING = "waiting"
    WORKING = "working"
    DONE = "done"
    FAILED = "failed"


class RunState(StrEnum):
    """The state of a run, by who waits for whom: the first of these that holds, in this order."""

    OVER = "over"
    PAUSED = "paused"
    RESTING = "resting"
    QUESTION = "question"
    NO_WORKER = "no_worker"
    STUCK = "stuck"
    UNSURE = "unsure"
    EXPLORING = "exploring"


RUN_STATUSES = {
    RunStatus.ACTIVE: "The agent acts, or waits for its parent.",
    RunStatus.PAUSED: "The operator paused it; no tick passes until it is resumed.",
    RunStatus.STOPPED: "The operator ended it; its open questions were withdrawn. It can be resumed.",
    RunStatus.FINISHED: "It reached what it was started for.",
    RunStatus.FAILED: "The worker could not go on; the reason says why. It can be resumed.",
}

QUERY_STATUSES = {
    QueryStatus.OPEN: "It waits for an answer.",
    QueryStatus.ANSWERED: "It was answered; the agent has not heard it yet.",
    QueryStatus.APPLIED: "The agent has heard the answer, at the answer's `applied_tick`.",
    QueryStatus.WITHDRAWN: "It is no longer asked: run or episode ended, or it was skipped twice.",
}

WAITING = {
    Waiting.GUIDANCE: "The agent waits for guidance before it moves.",
    Waiting.PREFERENCES: "The agent waits until fewer preference questions are open.",
    Waiting.STUCK: "No action was acceptable: its parent or the operator has to end the episode.",
    Waiting.UNSURE: "Every pair of moves was skipped: one of them has to be answered, or the episode ended.",
}

JOB_STATES = {
    JobState.WAITING: "No worker has taken it yet.",
    JobState.WORKING: "A worker is at it. If the worker ends, another one takes it.",
    JobState.DONE: "Its result is there, for ten minutes.",
    JobState.FAILED: "It has no result; the reason says why.",
}

RUN_STATES = {
    RunState.OVER: "The run was stopped, has finished or has failed.",
    RunState.PAUSED: "The operator paused the run.",
    RunState.RESTING: "The goal of answers is reached; the agent goes on once the goal is raised.",
    RunState.QUESTION: "A question waits for the person who is the parent.",
    RunState.NO_WORKER: "No worker raises the run.",
    RunState.STUCK: "No action was acceptable: its parent or the operator has to end the episode.",
    RunState.UNSURE: "Every pair of moves was skipped: one of them has to be answered, or the episode ended.",
    RunState.EXPLORING: "The agent acts on its own, or a scripted parent answers it.",
}

STATE_LABELS = {
    RunState.OVER: "over",
    RunState.PAUSED: "paused",
    RunState.RESTING: "goal reached",
    RunState.QUESTION: "a question waits",
    RunState.NO_WORKER: "no worker",
    RunState.STUCK: "no action acceptable",
    RunState.UNSURE: "every pair skipped",
    RunState.EXPLORING: "exploring",
}
"""The same in a word or two, for lists of runs."""

LIVING = (RunStatus.ACTIVE, RunStatus.PAUSED)
"""The statuses of runs that a worker raises."""
OVER = (RunStatus.STOPPED, RunStatus.FINISHED, RunStatus.FAILED)
"""The statuses in which a run stays, unless it is resumed."""
VERBS = {RunStatus.ACTIVE: "resume", RunStatus.PAUSED: "pause", RunStatus.STOPPED: "stop"}
"""The operator's verb that leads to a status."""
RESUMABLE = (RunStatus.STOPPED, RunStatus.FAILED)
"""The statuses from which the operator lets a run go on."""
