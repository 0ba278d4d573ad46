"""Fields of the parent's forms."""

from __future__ import annotations

from typing import Annotated

from fastapi import Form
from pydantic import Json

from parenting.server.api.bodies import Choice, ClientId, Replays
from parenting.server.api.names import DatabaseId, PublicId
from parenting.server.measures import Measured

ClientField = Annotated[ClientId, Form()]
ChoiceField = Annotated[Choice, Form()]
DatabaseField = Annotated[DatabaseId, Form()]
ReplaysField = Annotated[Replays | None, Form()]
"""Empty where no script counts."""
MeasuredField = Annotated[Json[Measured] | None, Form()]
"""JSON; empty where no script measures."""
QuestionField = Annotated[PublicId, Form()]
MaybeDatabase = Annotated[DatabaseId | None, Form()]
MaybeQuestion = Annotated[PublicId | None, Form()]
"""The same in forms of older versions, which name neither."""
