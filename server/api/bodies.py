"""Parameters and bodies of requests."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints

from parenting.envs.people_text import plain
from parenting.server import schemas
from parenting.server.access.current import own_name
from parenting.server.api.names import DatabaseId, PublicId
from parenting.server.job_kinds import (
    EpisodePayload,
    PolicyPayload,
    PretrainPayload,
    StatePayload,
    WalkPayload,
)
from parenting.server.level_check import TEXT_CHARACTERS
from parenting.server.measures import Measured
from parenting.server.new_run import LARGEST_INT, Goal, Name, NewRun, Pace, PersonsName
from parenting.server.patterns import CLIENT, SHA256
from parenting.server.schemas import By
from parenting.server.whole import WHOLE

ClientId = Annotated[
    str,
    StringConstraints(min_length=1, max_length=64, pattern=CLIENT),
    AfterValidator(own_name),  # whoever has one name answers under no other
]
Choice = schemas.Choice
Place = Annotated[int, Field(ge=0, le=LARGEST_INT), WHOLE]
Replays = Annotated[int, Field(ge=0, le=10_000), WHOLE]


class Strict(BaseModel):
    """A body that refuses unknown fields and converts no types."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


class LeaseBody(Strict):
    """The client that leases or releases a question."""

    client_id: ClientId = Field(
        description="A name of your choice; a browser uses the same one in all its tabs."
    )


class NextBody(LeaseBody):
    """The client that leases a question, and how long it waits for one."""

    wait: float = Field(
        0.0, ge=0, le=10, description="Seconds for which the request lies at the server while none is free."
    )


class RenewBody(LeaseBody):
    """The client that shows questions, and how long ago its person gave a sign of life."""

    questions: list[PublicId] = Field(max_length=100, description="The `public_id` of each question.")
    idle: float = Field(0.0, ge=0, description="Seconds since the person's last sign of life.")


class AnswerBody(Strict):
    """The parent's choice, and who decided."""

    choice: Choice = Field(description="left and right are the clips; neither: both are unacceptable.")
    client_id: ClientId = Field(description="The name under which the question was leased.")
    parent: By = Field("human", description="Who decided, a person or a script; stored with the answer.")
    database: DatabaseId | None = Field(None, description="The `database` that came with the question.")
    run: PublicId | None = Field(None, description="The `run_public_id` that came with it.")
    question: PublicId | None = Field(None, description="The `public_id` of the question.")
    replays: Replays | None = Field(
        None, description="How often the parent had the clips played again; null: this client does not tell."
    )
    measured: Measured | None = Field(
        None, description="What the client measured of this answer; null: it measures nothing."
    )

    @property
    def measures(self) -> dict[str, Any] | None:
        """The measures by name."""
        return None if self.measured is None else self.measured.model_dump()


class NamedBody(LeaseBody):
    """The client that takes its answer back or skips, and the names of the question."""

    database: DatabaseId | None = Field(None, description="The `database` that came with the question.")
    run: PublicId | None = Field(None, description="The `run_public_id` that came with it.")
    question: PublicId | None = Field(None, description="The `public_id` of the question.")


class SkipBody(NamedBody):
    """The client that skips, and the names of the question."""

    parent: By = Field("human", description="Who skips, a person or a script; stored with the skip.")
    measured: Measured | None = Field(
        None, description="What the client measured of this skip; null: it measures nothing."
    )

    @property
    def measures(self) -> dict[str, Any] | None:
        """The measures by name."""
        return None if self.measured is None else self.measured.model_dump()


class LevelBody(Strict):
    """A text with a level of one's own."""

    world: Name
    text: Annotated[str, StringConstraints(max_length=TEXT_CHARACTERS), AfterValidator(plain)] = Field(
        description="A level's text, or several levels' texts."
    )
    which: Name | None = Field(None, description="The name or number of one of several levels.")


class ImportBody(Strict):
    """A text with maps of another collection."""

    text: Annotated[str, StringConstraints(max_length=TEXT_CHARACTERS), AfterValidator(plain)]
    format: Literal["xsb", "frozenlake", "cliffwalking", "taxi", "gridworlds"] | None = Field(
        None, description="The maps' format; null: found by its signs."
    )
    world: Name | None = Field(None, description="The world of art of gridworlds; null: found by its signs.")


class NewRunBody(NewRun):
    """The settings of a new run, and what it begins with. `config` changes the preset."""

    from_policy: Annotated[str, StringConstraints(pattern=SHA256)] | None = Field(
        None, description="Begin with this policy: the `sha256` of one that was uploaded."
    )
    from_answers: PublicId | None = Field(
        None, description="Begin with X of the answers of this stored run, by its `public_id`."
    )


class PageErrorBody(Strict):
    """A fault of a script of our pages, as a browser tells it."""

    message: str = Field(min_length=1, max_length=500)
    source: str | None = Field(None, max_length=300, description="The address of the script.")
    line: Place | None = None
    column: Place | None = None
    stack: str | None = Field(None, max_length=4000)
    page: str | None = Field(None, max_length=300, description="The path of the page.")
    run: PublicId | None = Field(None, description="The `public_id` of the run that the page shows.")


class ChangeBody(Strict):
    """A new value for a probability of Sec. 2."""

    name: Literal["p_guid", "p_rec", "p_pref", "p_train"]
    value: float = Field(ge=0, le=1)


class GoalBody(Strict):
    """The goal of a run."""

    goal: Goal | None = Field(description="Number of answers after which the run rests; null: none.")


class RollBackBody(Strict):
    """The tick that a run is rolled back to, and the name of the new run."""

    tick: Place = Field(description="The last tick that both runs have in common.")
    name: PersonsName | None = Field(None, description="null: the name of the run, and the tick.")


class PaceBody(Strict):
    """The pace of a run."""

    pace: Pace | None = Field(description="At most this many ticks a second; null: no limit.")


class WalkBody(LeaseBody):
    """A walk: an episode that the present policy plays by itself."""

    kind: Literal["walk"]
    payload: WalkPayload = WalkPayload()


class PolicyBody(LeaseBody):
    """The present policy in every cell."""

    kind: Literal["policy"]
    payload: PolicyPayload = PolicyPayload()


class EpisodeBody(LeaseBody):
    """An episode of the life, shown again."""

    kind: Literal["episode"]
    payload: EpisodePayload = EpisodePayload()


class StateBody(LeaseBody):
    """The policy in one state."""

    kind: Literal["state"]
    payload: StatePayload = StatePayload()


class PretrainBody(LeaseBody):
    """Weights for runs in a world on levels of one size (Sec. 3.1.4)."""

    kind: Literal["pretrain"]
    payload: PretrainPayload


JobBody = Annotated[WalkBody | PolicyBody | EpisodeBody | StateBody, Field(discriminator="kind")]
"""A job of a run for any worker, and the client that asks: one body for each of `job_kinds.KINDS`."""
