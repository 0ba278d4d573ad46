"""The route by which pages report faults of their own scripts, for the log."""

from __future__ import annotations

import structlog
from fastapi import Request

from parenting.server.admission import admitted_router
from parenting.server.api.bodies import PageErrorBody
from parenting.server.api.responses import write_responses
from parenting.server.log_limit import LogLimit

router = admitted_router(tags=["pages"])

log = structlog.get_logger()


@router.post("/page-errors", summary="Report a page's fault", status_code=204, responses=write_responses())
def report_page_error(request: Request, body: PageErrorBody) -> None:
    """Write a fault of a page's script into the server's log, at most one a second; nothing is stored."""
    limit: LogLimit = request.app.state.page_errors
    fields = body.model_dump(exclude_none=True)
    limit.say(
        "page",
        log.warning,
        "page error",
        said=fields.pop("message"),
        trace=fields.pop("stack", None),
        **fields,
    )
