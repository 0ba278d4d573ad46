"""The pages: a view, a template, a test and a section of docs/guide-parents.md each."""

from fastapi import APIRouter

from parenting.server.pages.access import router as access
from parenting.server.pages.audit import router as audit
from parenting.server.pages.board import router as board
from parenting.server.pages.carried import router as carried
from parenting.server.pages.comparison import router as comparison
from parenting.server.pages.controls import router as controls
from parenting.server.pages.dashboard import router as dashboard
from parenting.server.pages.docs import router as docs
from parenting.server.pages.entry import router as entry
from parenting.server.pages.episodes import router as episodes
from parenting.server.pages.grid import router as grid
from parenting.server.pages.growth import router as growth
from parenting.server.pages.history import router as history
from parenting.server.pages.levels import router as levels
from parenting.server.pages.parent import router as parent
from parenting.server.pages.persons import router as persons
from parenting.server.pages.practice import router as practice
from parenting.server.pages.pretraining import router as pretraining
from parenting.server.pages.render import error_page
from parenting.server.pages.revisions import router as revisions
from parenting.server.pages.settings import router as settings
from parenting.server.pages.skips import router as skips
from parenting.server.pages.start import router as start
from parenting.server.pages.take import router as take
from parenting.server.pages.walk import router as walk
from parenting.server.pages.why import router as why

__all__ = ["error_page", "router"]

router = APIRouter(include_in_schema=False)
router.include_router(entry)
router.include_router(start)
router.include_router(levels)
router.include_router(pretraining)
router.include_router(carried)
router.include_router(parent)
router.include_router(revisions)
router.include_router(practice)
router.include_router(walk)
router.include_router(growth)
router.include_router(episodes)
router.include_router(board)
router.include_router(grid)
router.include_router(skips)
router.include_router(dashboard)
router.include_router(comparison)
router.include_router(controls)
router.include_router(take)
router.include_router(history)
router.include_router(settings)
router.include_router(persons)
router.include_router(why)
router.include_router(access)
router.include_router(audit)
router.include_router(docs)
