"""`parenting person delete` is killed (SIGKILL) again and again: given once more, it ends, and all is gone.

Each kill meets what the one before has left. The other person's answers, and the chain, hold all the while.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Engine, func, select

from parenting.server import chain, erasure
from parenting.server.db import Database, connect
from parenting.server.new_run import start
from parenting.server.persons import name_person, pseudonyms
from parenting.server.settings import Settings
from parenting.server.store.scrub import scrub
from parenting.server.tables import Answer
from parenting.server.verify import verify
from tests.faults import tap
from tests.faults.clients import Nth
from tests.faults.figures import Figures
from tests.faults.points import Point, Trigger
from tests.faults.tap import Moment
from tests.lengths import length
from tests.server.processes import Command
from tests.server.raising import ISLAND
from tests.server.test_erasure import ANN, BOB, NAME, marks_in, raise_by

pytestmark = [
    pytest.mark.only("sqlite", "PostgreSQL's files are its administrator's"),
    pytest.mark.torture,
    pytest.mark.timeout(length(600, 3600)),
]
KILLS = length(1, 60)
"""Kills at any statement or commit, besides those at the named points."""
SHARED, SECONDS = 1, 120.0
OUTSIDE = "external-0042"


def armed(point: Point) -> None:
    tap.listen(Trigger(point))


def doomed(number: int) -> None:
    tap.listen(Nth(number))


def killed_before(engine: Engine) -> bool:
    """In the place of `scrub`: the names are gone, and the file is as it was."""
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError("killed")


def killed_amid(how: str, engine: Engine) -> bool:
    """In the place of `scrub`: killed while SQLite writes the file afresh, or once it has."""

    def now(*_: object) -> int:
        os.kill(os.getpid(), signal.SIGKILL)
        return 0

    with closing(engine.raw_connection()) as connection:  # the one that `scrub` gets, too
        driver: Any = connection.driver_connection
        if how == "amid VACUUM":
            driver.set_progress_handler(now, 50)
        else:
            driver.set_trace_callback(lambda said: now() if "wal_checkpoint" in said else None)
    return scrub(engine)


POINTS: dict[str, Callable[[], object] | dict[str, Any]] = {
    "at the mark": partial(armed, Point("", "before", "UPDATE person SET deleting", commit=True)),
    "at the end of their own run": partial(armed, Point("", "before", "DELETE FROM run", commit=True)),
    "before the new checkpoint": partial(armed, Point("", "before", "INSERT INTO checkpoint")),
    "at its commit": partial(armed, Point("", "before", "INSERT INTO checkpoint", commit=True)),
    "after its commit": partial(armed, Point("", "after", "INSERT INTO checkpoint", commit=True)),
    "before their names go": partial(armed, Point("", "before", "DELETE FROM person_client", commit=True)),
    "before VACUUM": {"parenting.server.erasure.scrub": killed_before},
    "amid VACUUM": {"parenting.server.erasure.scrub": partial(killed_amid, "amid VACUUM")},
    "after VACUUM": {"parenting.server.erasure.scrub": partial(killed_amid, "after VACUUM")},
}


@pytest.fixture
def ann(db: Database) -> str:
    """The pseudonym of a person who raised a run together with another one, and one alone."""
    assert start(db, ISLAND.new("human")).id == SHARED
    raise_by(db, SHARED, (ANN, BOB), 12)
    raise_by(db, start(db, ISLAND.new("human")).id, (ANN,), 6)
    found = pseudonyms(db, [ANN])[ANN]
    name_person(db, found, NAME, OUTSIDE)
    db.close()
    return found


def delete(pseudonym: str, data: Path, way: Callable[[], object] | dict[str, Any] | None = None) -> Command:
    """Run the command to its end, killed or not."""
    patches = way if isinstance(way, dict) else None
    prepare = way if callable(way) else None
    one = Command("person", "delete", pseudonym, "--yes", data=data, patches=patches, prepare=prepare)
    one.wait(SECONDS)
    said, code = one.said(), one.process.exitcode
    one.output.unlink()  # it names the person
    assert code in (0, -signal.SIGKILL), said
    return one


def of_bob(data: Path) -> list[tuple[Any, ...]]:
    """The other person's answers; the chain of the shared run holds whenever somebody looks."""
    db = connect(Settings(data=data, database_url=None))
    try:
        assert chain.check(db, SHARED).problems == []
        told = (Answer.number, Answer.choice, Answer.standing, Answer.applied_tick, Answer.digest)
        with db.read() as session:
            return [tuple(row) for row in session.execute(select(*told).where(Answer.client_id == BOB))]
    finally:
        db.close()


def hold_that_nothing_is_left(data: Path, pseudonym: str) -> None:
    marks = (ANN, pseudonym, NAME, OUTSIDE)
    assert not any(marks_in(data, *marks).values())
    db = connect(Settings(data=data, database_url=None))
    try:
        assert erasure.under_way(db) == []
        assert verify(db, SHARED).sound
        with db.read() as session:
            hers = select(func.count()).select_from(Answer).where(Answer.erased.is_not(None))
            assert (session.scalar(hers) or 0) > 1
    finally:
        db.close()


def test_a_deletion_that_is_killed_at_each_of_its_steps_ends(
    ann: str, settings: Settings, figures: Figures
) -> None:
    others = of_bob(settings.data)
    assert all(marks_in(settings.data, ANN, ann, NAME, OUTSIDE).values())
    for place, way in POINTS.items():
        killed = delete(ann, settings.data, way)
        assert killed.process.exitcode == -signal.SIGKILL, place
        figures.count("SIGKILLs of a deletion", place)
        assert of_bob(settings.data) == others, place
    delete(ann, settings.data)
    hold_that_nothing_is_left(settings.data, ann)
    assert of_bob(settings.data) == others
    again = Command("person", "delete", ann, "--yes", data=settings.data)
    assert again.wait(SECONDS) == 2, "there is no such person any more"


def test_one_kill_anywhere_is_made_up_for(
    ann: str, settings: Settings, tmp_path: Path, rng: random.Random, figures: Figures
) -> None:
    others, seen, whole = of_bob(settings.data), list[Moment](), tmp_path / "whole"
    shutil.copytree(settings.data, whole)
    db = connect(Settings(data=whole, database_url=None))
    with tap.listening(seen.append):
        from parenting.server.erasing import delete_person

        assert delete_person(db, ann)
    db.close()
    for number in sorted(rng.sample(range(1, len(seen) + 1), KILLS)):
        data = tmp_path / f"killed-{number}"
        shutil.copytree(settings.data, data)
        figures.count("SIGKILLs of a deletion", "anywhere")
        delete(ann, data, partial(doomed, number))
        assert of_bob(data) == others
        delete(ann, data)
        hold_that_nothing_is_left(data, ann)
        shutil.rmtree(data)
