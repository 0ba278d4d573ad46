"""The routes that check a level of one's own and make levels of maps of others; nothing is stored."""

from __future__ import annotations

from parenting.server.admission import admitted_router
from parenting.server.api.bodies import ImportBody, LevelBody
from parenting.server.api.responses import write_responses
from parenting.server.level_check import (
    CheckedLevelSchema,
    ImportedLevelsSchema,
    check,
    import_levels,
)

router = admitted_router(tags=["runs"])


@router.post("/levels/check", summary="Check a level of one's own", responses=write_responses())
def check_level(body: LevelBody) -> CheckedLevelSchema:
    """Read a level's text as people have it, and name the first rule of its world that it breaks.

    The sentences are those of the command line. The reply to a level that is wrong is 200, too:
    `error` names line, column and rule. Of several levels in a text `which` chooses one.
    """
    return check(body.world, body.text, body.which)


@router.post("/levels/import", summary="Make levels of maps of others", responses=write_responses())
def import_maps(body: ImportBody) -> ImportedLevelsSchema:
    """Make levels of Sokoban's XSB, of maps of Gymnasium or of art of DeepMind's gridworlds.

    It does what `parenting worlds import` does, and says what could not be carried over.
    """
    return import_levels(body.text, body.format, body.world)
