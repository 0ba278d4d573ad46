"""The form of a dashboard that takes from a run: a new run that goes on from one of its ticks."""

from __future__ import annotations

from functools import partial

from fastapi import Request, Response
from pydantic import TypeAdapter, ValidationError

from parenting.server.admission import admitted_router
from parenting.server.api.bodies import Place
from parenting.server.api.names import RunId
from parenting.server.deps import Db, SettingsOf, start_within_limits
from parenting.server.errors import InvalidFieldsError
from parenting.server.pages.dashboard import dashboard_page
from parenting.server.pages.render import redirect
from parenting.server.pages.start import FormFields
from parenting.server.rollback import roll_back

router = admitted_router(include_in_schema=False)

NO_TICK = "A tick is a whole number, from 0 to the run's last one."
_TICK: TypeAdapter[int] = TypeAdapter(Place)


@router.post("/runs/{run_id}/roll-back")
def roll_run_back(
    request: Request, run_id: RunId, db: Db, settings: SettingsOf, form: FormFields
) -> Response:
    """Start a run that goes on from a tick of this one, and show it."""
    try:
        tick = _TICK.validate_python(form.get("roll_back", "").strip())
        new = start_within_limits(request, partial(roll_back, db, run_id, tick, None, settings.runs))
    except ValidationError:
        return dashboard_page(db, run_id, form, {"roll_back": NO_TICK})
    except InvalidFieldsError as error:
        return dashboard_page(db, run_id, form, {"roll_back": error.fields[0][1]})
    return redirect(f"/runs/{new.public_id}")
