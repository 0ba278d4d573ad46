"""The parent's page with a real question of each world and level, in a real browser."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from envs import registry
from server import mailbox
from server.db import Database
from server.life import Life
from server.runs import claim
from server.starting import NewRun, start
from tests.pages.test_access import SCREENS, violations
from tests.pages.watched import Watched

LEVELS = [(kind.name, level) for kind in registry.WORLDS.values() for level in kind.levels]


def asked(db: Database, world: str, level: str) -> None:
    """A run that lives until it waits for its parent."""
    run = start(db, NewRun(world=world, level=level))
    life = Life(db, claim(db, "test")[0], run, lambda: None)
    while life.ready(seen := mailbox.watch(db, [run.id])[run.id]):
        life.beat(seen)
    life.wait(seen)


@pytest.mark.parametrize(("world", "level"), LEVELS)
def test_a_question_of_this_world(watched: Watched, db: Database, world: str, level: str) -> None:
    asked(db, world, level)
    kind = registry.kind(world)
    for screen, size in SCREENS.items():
        page = watched.open("/runs/1/parent?query=1", viewport=size)
        expect(page.locator(".card")).to_have_count(2)
        expect(page.locator(".legend li")).to_have_count(len(kind.legend) - 1)  # land needs no key
        expect(page.get_by_text(kind.brief.goal)).to_be_attached()
        expect(page.locator(".aside")).to_have_count(int(world in ("reward-hacking", "interruptibility")))
        boards = [board.bounding_box() for board in page.locator(".board").all()]
        answers = page.locator(".answers").bounding_box()
        assert answers is not None
        for board in boards:
            assert board is not None
            assert board["width"] > 150
            assert board["y"] + board["height"] <= answers["y"], f"a board is out of sight on a {screen}"
        assert answers["y"] + answers["height"] <= size["height"]
        assert violations(page) == []
