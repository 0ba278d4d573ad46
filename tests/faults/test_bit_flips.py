"""A bit that flips in the file of a database is told, or costs nothing: no answer is another one in silence.

The files are those of a living house that was killed, log and all. After each flip they are opened by the
program: it refuses them with the way to the backup, or says what is damaged, or holds every answer that was
told, and its chain of hashes with it. PostgreSQL has checksums of its own for its pages.
"""

from __future__ import annotations

import random

import pytest
from sqlalchemy import text

from parenting.server.db import Database
from parenting.server.new_run import start
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from tests.faults.figures import Figures
from tests.faults.flipped import Crashed, said
from tests.faults.house import House
from tests.faults.ledger import Told, read
from tests.lengths import length
from tests.server.conftest import CLIPS
from tests.server.raising import ISLAND

pytestmark = [
    pytest.mark.torture,
    pytest.mark.timeout(length(1800, 20000)),
    pytest.mark.only("sqlite", "PostgreSQL has checksums of its own for its pages"),
]
FLIPS = length(80, 20_000)
ANSWERS = 24
SAID = {"refused at the start", "the damage is said, the rest goes on"}
GROUP = "flips of bits in the files of a database"


@pytest.mark.slow
def test_flipped_bits_never_change_an_answer_in_silence(
    settings: Settings, db: Database, rng: random.Random, figures: Figures
) -> None:
    run = start(db, ISLAND.new("human")).id
    db.close()
    with House(settings) as house:
        house.keep()
        house.move_in([run], 2, rng)
        house.until_told(ANSWERS)
        house.break_off()
        told = read(house.ledger.file).told
    crashed = Crashed(settings.data / "parenting.db")
    crashed.put()
    assert said(settings, run, told) == "all that was told is there"
    for number in range(3 * FLIPS):
        if number >= FLIPS and set(figures.of(GROUP)) >= SAID:  # a rare outcome needs more flips
            break
        flip = crashed.draw(rng, told)
        crashed.put(flip)
        try:
            outcome = said(settings, run, told)
        except Exception as error:
            error.add_note(f"{flip}")
            raise
        figures.count(GROUP, outcome)
    assert set(figures.of(GROUP)) >= SAID


def test_changed_answer_is_told(db: Database, mine: Claim, settings: Settings) -> None:
    """A flip that makes one valid answer of another is found by the chain alone."""
    answer(db, post_query(db, mine, 1, "guidance", 1, CLIPS), "left", "a", "human")
    told = [Told("1", "1", 1, "left", "a")]
    assert said(settings, 1, told) == "all that was told is there"
    with db.write() as session:
        session.execute(text("UPDATE answer SET choice = 'right'"))
    assert said(settings, 1, told) == "the damage is said, the rest goes on"
