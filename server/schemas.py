"""Schemas of the API's replies, which the pages use too. Times are ISO 8601 in UTC."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from parenting.agent.config import GardenParent
from parenting.server.measures import Measured
from parenting.server.statuses import QueryStatus, RunState, RunStatus, Waiting

# The words of server.tables, as types: a test holds them equal.
Kind = Literal["guidance", "preference"]
Choice = Literal["left", "right", "either", "neither"]
Said = Literal["left", "right", "either", "neither", "skip"]
By = Literal["human", "scripted"]


class Schema(BaseModel):
    """The root of all schemas. The text under a field is its description in OpenAPI."""

    model_config = ConfigDict(use_attribute_docstrings=True)


class DamagedSchema(Schema):
    """A row that cannot be read, in its place in a list. The rest of the database goes on."""

    id: int
    damaged: str
    """The columns that cannot be read, and the reasons."""


class OpenSchema(Schema):
    """The number of open questions, by kind."""

    guidance: int
    preference: int


Chances = tuple[float, float, float, float]
"""The probabilities of up, down, left and right."""


class LessonSchema(Schema):
    """The effect of an answer: the policy in the cell of its question."""

    tick: int
    """The tick at which the agent heard the answer."""
    kind: Kind
    cell: tuple[int, int]
    """Row and column of the agent when it asked."""
    before: Chances
    """The probabilities of up, down, left and right before the answer was heard."""
    after: Chances
    """The same now, after the gradient steps since."""


class RunSchema(Schema):
    """A run as it is now."""

    id: int
    """Its number, a short name within this database."""
    public_id: str
    """Its name everywhere: random, and never given again."""
    database: str
    """The UUID of the database that it is in."""
    created: datetime
    name: str | None
    description: str | None
    """The notes of its researchers: at most 2000 characters."""
    tags: list[str]
    """Words by which its researchers find it."""
    archived: datetime | None
    """Since when the list on the first page leaves it out; null: it does not."""
    deleting: datetime | None
    """When its deletion was confirmed: it is not there but in lists; null: nobody deletes it."""
    world: str
    level: str
    preset: str
    config: dict[str, Any]
    """Every hyperparameter as the run was started with it; changes since then are operator's events."""
    seed: int
    batch: str | None
    """The batch of which it is a trial (`parenting run --store`): its metrics are kept, and no questions,
    answers or checkpoints; null: a worker raises it.
    """
    trial: int | None
    """The number of the trial in its batch, from 0 on."""
    weights: str | None
    """The SHA-256 of the pre-trained weights that the agent began with; null: fresh ones."""
    origin: dict[str, Any] | None
    """The earlier policy, answers or run that it began with, each with its hash and public id; null: none."""
    parent: By
    script: str | None
    """The errors of a scripted parent, such as noisy:eps=0.1; scripted: none. Null where people answer."""
    guidance_layout: Literal["one", "two"]
    """The boards on which guidance is asked: one with both moves, or two as in the paper."""
    practice: Literal["offered", "required"]
    """required: a parent practises before the first question, once in each browser."""
    words: Literal["plain", "guide"]
    """guide: a question in words also tells how long a safe way is, which gives its answer away."""
    remarks: bool
    """True if the page tells the parent of hasty and contradictory answers."""
    finish: str
    """Its end: optimal (its argmax policy is), goal:N (it has heard N answers), stages:T (stage T is
    over), or never.
    """
    status: RunStatus
    reason: str | None
    """The reason why it is over, in a sentence."""
    tick: int
    """The last tick, as last reported."""
    maturity: int
    """The stage T that the agent is in (Sec. 2.4), as last reported."""
    speed: float | None
    """Ticks a second, as last measured."""
    waiting: Waiting | None
    """The reason why no tick passes: the agent waits for guidance, for fewer open preference questions, or
    for the end of its episode (*stuck*: no action was acceptable), or for an answer to what was skipped
    (*unsure*: every pair of moves was); null while it acts.
    """
    state: RunState
    """One word for who waits for whom, the first of these that holds: over, paused, resting (the goal is
    reached), question (one waits for a person), no_worker, stuck, unsure, exploring.
    """
    goal: int | None
    """Answered questions after which the run rests; null: never."""
    resting: bool
    """True if the goal is reached: no tick passes until it is raised."""
    pace: float | None
    """Ticks a second at most; null: as fast as it can."""
    optimal: bool
    """True if the argmax policy takes a shortest safe path to the goal (never in the garden)."""
    answers: int
    """The number of answers so far, superseded ones included."""
    standing: int
    """The number of answers that stand: goal and progress count these."""
    milestones: dict[str, int] | None
    """The first times of the agent, each with its tick: `goal` (it reached the goal), `calm` (it made no
    unsafe move in 100 ticks); null before the first one.
    """
    lesson: LessonSchema | None
    """The effect of the last answer that the agent heard; null before the first one."""
    skipped: int
    """The number of times that a question was skipped; `answers` counts these rows, `standing` does not."""
    open: OpenSchema
    worker: Literal["alive", "silent", "done"]
    """alive, silent (none raises this run, nor will one that is alive), or done (the run is over)."""
    raised_by: str | None
    """The name of the worker that raises it, HOST:PROCESS; null: none does now."""


class FrameSchema(Schema):
    """One moment of a clip: the true board, the board that the agent saw, and the positions."""

    ground: list[str]
    """The true board without agent and box, a string of glyphs for each row."""
    observed: list[str]
    """The board that the agent saw."""
    agent: tuple[int, int]
    """Row and column."""
    box: tuple[int, int] | None


class ClipSchema(Schema):
    """A clip: `length` actions between `length + 1` frames."""

    actions: list[Literal["up", "down", "left", "right"]]
    length: int
    frames: list[FrameSchema]
    chance: float | None = Field(None, exclude_if=lambda chance: chance is None)  # of a likeliest outcome


class PolicySchema(Schema):
    """The policy that asked; null for questions of versions that did not store it."""

    stage: int | None
    gradient_steps: int | None
    """Gradient steps within its stage."""


class QuerySchema(Schema):
    """A question: two clips, of which the parent prefers left, right, either or neither."""

    id: int
    run: int
    database: str
    """The UUID of the database; an answer that names it is stored nowhere else."""
    run_public_id: str
    public_id: str
    tick: int
    """The tick at which the agent asked."""
    kind: Kind
    maturity: int
    """The stage T that the clips were recorded at; 1 for guidance."""
    votes: int
    """Guidance that is asked again to be sure: the answers heard before on this pair of moves; else 0."""
    policy: PolicySchema
    status: QueryStatus
    posted: datetime
    leased_until: datetime | None
    """The time until which it is offered to nobody else."""
    left: ClipSchema
    right: ClipSchema


class WorldSchema(Schema):
    """Everything that is needed to draw and to answer a question without the world's code."""

    name: str
    level: str
    text: str
    """The level's file, header included."""
    legend: dict[str, str]
    """The name of each glyph."""
    brief: dict[str, str]
    """The goal and the danger, a sentence each."""


class ProgressSchema(Schema):
    """The parent's progress."""

    answered: int
    open: int


class ParentSchema(Schema):
    """The settings of the parent's values: gamma of Eq. (7), and the garden's inner path (Sec. 3.3)."""

    gamma: float
    inside: GardenParent


class LeasedSchema(QuerySchema):
    """A leased question, with what a parent who knows nothing else needs to answer it."""

    world: WorldSchema
    parent: ParentSchema
    progress: ProgressSchema
    sentences: tuple[str, ...]
    """The question in words: the difference of the clips, then where everything lies from the agent."""


class RenewedSchema(Schema):
    """The questions of a page by who has them, as public ids."""

    yours: list[str]
    """Held by this client, or by nobody: an answer is welcome."""
    elsewhere: list[str]
    """Held by somebody else."""
    closed: list[str]
    """Answered, withdrawn, or not of this run."""


class AnswerSchema(Schema):
    """The answer that stands for a question; *skip*: the parent could not tell."""

    number: int
    choice: Said
    parent: By
    received: datetime
    applied_tick: int | None
    """The tick at which the agent heard it; null: not yet."""
    measured: Measured | None
    """Measures that the page took; null: it was given by a program, or by a page that measured nothing."""


class AskedSchema(QuerySchema):
    """A question with its answer, if one stands."""

    answer: AnswerSchema | None


class DamagedMetricSchema(Schema):
    """Metrics that cannot be read."""

    tick: int | None
    damaged: str
    """The columns that cannot be read, and the reasons."""


class MetricSchema(Schema):
    """The metrics of one tick; null where a number was not finite."""

    tick: int
    values: dict[str, float | int | None]
