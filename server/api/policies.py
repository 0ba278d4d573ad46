"""The route that takes a policy for runs to begin with."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Query
from pydantic import Field

from parenting.server.admission import admitted_router
from parenting.server.api.lists import Part
from parenting.server.api.responses import write_responses
from parenting.server.deps import Db
from parenting.server.inherited import PolicySchema, upload

router = admitted_router(tags=["runs"])


class UploadPart(Part):
    """The name of an uploaded file."""

    file: str = Field("policy.safetensors", max_length=100, description="The file's name, for display.")


Bytes = Annotated[
    bytes, Body(media_type="application/octet-stream", description="A file of `parenting policy`, whole.")
]


@router.post("/policies", summary="Upload a policy", status_code=201, responses=write_responses(409))
def upload_policy(db: Db, body: Bytes, part: Annotated[UploadPart, Query()]) -> PolicySchema:
    """Upload a policy's file, at most 16 MiB. Send its `sha256` as `from_policy` with a new run.

    It is kept for an hour until a run begins with it, and at most sixteen such are kept (409).
    """
    return upload(db, part.file, body)
