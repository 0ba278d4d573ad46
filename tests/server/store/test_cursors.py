"""Lists that are followed by a cursor skip nothing, however commits overtake each other."""

import threading
from collections.abc import Callable, Sequence

from parenting.server.db import Database, connect
from parenting.server.operator_events import add_operator_event
from parenting.server.queue.answers import answer
from parenting.server.queue.worker_side import post_query
from parenting.server.reads.answers import after
from parenting.server.reads.pagination import operator_events_after
from parenting.server.runs import Claim
from parenting.server.settings import Settings
from tests.server.conftest import CLIPS

WRITERS = 4
ROWS = 40


def followed(
    settings: Settings, write: Callable[[Database, int], object], read: Callable[[int], Sequence[int]]
) -> list[int]:
    """The rows that a reader sees who asks for all after the last, while rows are written at once."""
    others = [connect(settings) for _ in range(WRITERS)]
    seen: list[int] = []
    done = threading.Event()

    def follow() -> None:
        while True:
            last_look = done.is_set()
            seen.extend(read(seen[-1] if seen else 0))
            if last_look:
                return

    def act(number: int) -> None:
        for row in range(number, ROWS, WRITERS):
            write(others[number], row)

    follower = threading.Thread(target=follow)
    writers = [threading.Thread(target=act, args=(number,)) for number in range(WRITERS)]
    for thread in (follower, *writers):
        thread.start()
    for thread in writers:
        thread.join()
    done.set()
    follower.join()
    for other in others:
        other.close()
    return seen


def test_answers_by_their_number(db: Database, settings: Settings, mine: Claim) -> None:
    """An id that the database draws would not do: it is drawn before the commit."""
    posted = [post_query(db, mine, tick, "preference", 1, CLIPS) for tick in range(ROWS)]
    seen = followed(
        settings,
        lambda other, row: answer(other, posted[row], "left", f"client{row}", "human"),
        lambda last: [found.answer.number for found in after(db, mine.run_id, last)],
    )
    assert seen == list(range(1, ROWS + 1))


def test_operator_events_by_their_id(db: Database, settings: Settings, mine: Claim) -> None:
    """It is drawn while the run is locked, so within a run ids are committed in their order."""
    seen = followed(
        settings,
        lambda other, row: add_operator_event(other, mine.run_id, "end_episode", {"kind": "end_episode"}),
        lambda last: [event.id for event in operator_events_after(db, mine.run_id, last, ROWS).rows],
    )
    assert len(seen) == ROWS
