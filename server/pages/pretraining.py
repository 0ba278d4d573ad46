"""Pre-training before a run: a worker makes the weights that its form lacks, and then the run begins."""

from __future__ import annotations

from contextlib import suppress

from fastapi import Request, Response

from parenting.server import jobs
from parenting.server.admission import admitted_router
from parenting.server.deps import Db, SettingsOf, notify_worker
from parenting.server.errors import Conflict, NotFound
from parenting.server.pages.render import page
from parenting.server.pages.start import FormFields, create, filled_form, missing, settings_of
from parenting.server.reads.jobs import job_schema
from parenting.server.statuses import JobState

router = admitted_router(include_in_schema=False)

JOB = "pretraining"
"""The field of the form that names the job."""
CANCEL = "cancel"
"""The field of the button that cancels it."""


@router.post("/pretraining")
def pretraining(request: Request, db: Db, settings: SettingsOf, form: FormFields) -> Response:
    """Ask for the weights, tell how far they are, and start the run once they are there.

    Whoever cancels comes back to the form.
    """
    given = {name: text for name, text in form.items() if name not in (JOB, CANCEL)}
    if CANCEL in form:
        with suppress(NotFound, Conflict):  # it is over
            jobs.cancel(db, form.get(JOB, ""))
        return filled_form(db, given)
    offer = missing(db, settings.weights, settings_of(given))
    if offer is None:
        return create(request, db, settings, given)  # they are there, or something else is wrong
    wanted = offer.wanted
    try:
        job = jobs.get(db, form[JOB]) if JOB in form else None
    except NotFound:
        job = None
    if job is None:
        size = {"world": wanted.world.name, "height": wanted.height, "width": wanted.width}
        job = jobs.ask_of_no_run(db, "pretrain", size, "page")
        notify_worker(request)
    shown = job_schema(db, job)
    failed = job.state is JobState.FAILED
    return page("pretraining.html", 200, offer=offer, job=shown, form=given, failed=failed)
