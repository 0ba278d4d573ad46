"""Presence: leases end with attention or after a page was left, and others can take them over."""

import pytest

from parenting.server.db import Database
from parenting.server.queue.answers import answer, get_query
from parenting.server.queue.leases import LEASE_SECONDS, lease, take
from parenting.server.queue.presence import ATTENTION_SECONDS, GRACE_SECONDS, held, holder, leave, renew
from parenting.server.queue.worker_side import post_query
from parenting.server.runs import Claim, set_goal
from parenting.server.tables import Run
from tests.server.conftest import CLIPS, Clock


def leased(db: Database, run: Run, client: str) -> int | None:
    query = lease(db, run.id, client)
    return None if query is None else query.id


def renewed(db: Database, run: Run, query: int, client: str = "a", idle: float = 0.0) -> str:
    """The holder of the question after `client` renewed it: yours, elsewhere or closed."""
    name = get_query(db, query).public_id
    found = renew(db, run.id, client, [name], LEASE_SECONDS, idle)
    (who,) = [who for who, names in vars(found).items() if names == [name]]
    return str(who)


def test_renewing_holds_a_question_while_somebody_looks(
    db: Database, run: Run, guidance: int, clock: Clock
) -> None:
    leased(db, run, "a")
    for _ in range(5):
        clock.pass_seconds(LEASE_SECONDS - 1)
        assert renewed(db, run, guidance) == "yours"
    assert leased(db, run, "b") is None


def test_a_page_that_nobody_looks_at_holds_no_question_longer_than_attention_lasts(
    db: Database, run: Run, guidance: int, clock: Clock
) -> None:
    leased(db, run, "a")
    for idle in range(25, 10 * 60, 25):
        clock.pass_seconds(25)
        assert renewed(db, run, guidance, idle=idle) == "yours", "nobody else waits"
        if idle < ATTENTION_SECONDS:
            assert held(db, run.id).leases
        elif idle > ATTENTION_SECONDS + 25:
            assert held(db, run.id).leases == []
    assert leased(db, run, "b") == guidance
    assert renewed(db, run, guidance) == "elsewhere"
    assert answer(db, guidance, "left", "a", "human").number == 1, "an answer that comes first stands"
    assert renewed(db, run, guidance, "b") == "closed"


def test_who_comes_back_before_others_came_holds_the_question_again(
    db: Database, run: Run, guidance: int, clock: Clock
) -> None:
    leased(db, run, "a")
    clock.pass_seconds(ATTENTION_SECONDS * 5)
    assert renewed(db, run, guidance, idle=0) == "yours"
    assert leased(db, run, "b") is None


def test_what_was_left_is_free_after_the_grace(db: Database, run: Run, mine: Claim, clock: Clock) -> None:
    first, second = (post_query(db, mine, tick, "preference", 1, CLIPS) for tick in (1, 2))
    leased(db, run, "a")
    leased(db, run, "b")
    leave(db, run.id, "a")
    clock.pass_seconds(GRACE_SECONDS - 1)
    assert leased(db, run, "c") is None
    clock.pass_seconds(1)
    assert [leased(db, run, "c"), leased(db, run, "d")] == [first, None], "the second is still held by b"
    assert renewed(db, run, second, "b") == "yours"


@pytest.mark.parametrize("again", [leased, lambda db, run, client: renewed(db, run, 1, client)])
def test_a_reload_or_a_glance_elsewhere_keeps_the_question(
    db: Database, run: Run, guidance: int, clock: Clock, again: object
) -> None:
    leased(db, run, "a")
    leave(db, run.id, "a")
    clock.pass_seconds(GRACE_SECONDS - 1)
    again(db, run, "a")  # type: ignore[operator]  # one of two functions
    clock.pass_seconds(LEASE_SECONDS - 1)
    assert leased(db, run, "b") is None


def test_leaving_lengthens_no_lease_and_frees_no_answer(
    db: Database, run: Run, guidance: int, clock: Clock
) -> None:
    leased(db, run, "a")
    clock.pass_seconds(LEASE_SECONDS - 1)
    leave(db, run.id, "a")
    clock.pass_seconds(1)
    assert leased(db, run, "b") == guidance
    leave(db, run.id, "a")  # it holds nothing
    clock.pass_seconds(GRACE_SECONDS)
    assert leased(db, run, "c") is None


def test_a_question_is_taken_over_at_once(db: Database, run: Run, mine: Claim, guidance: int) -> None:
    assert leased(db, run, "laptop") == guidance
    assert leased(db, run, "phone") is None
    taken = take(db, run.id, "phone")
    assert taken is not None
    assert taken.id == guidance
    assert renewed(db, run, guidance, "laptop") == "elsewhere"
    assert leased(db, run, "laptop") is None
    free = post_query(db, mine, 50, "preference", 1, CLIPS)
    again = take(db, run.id, "phone")
    assert again is not None
    assert again.id == guidance, "one's own first"
    other = take(db, run.id, "tablet")
    assert other is not None
    assert other.id == free, "what is free before what others hold"


def test_nothing_is_taken_over_beyond_the_goal(db: Database, run: Run, mine: Claim, guidance: int) -> None:
    post_query(db, mine, 50, "preference", 1, CLIPS)
    answer(db, guidance, "left", "a", "human")
    set_goal(db, run.id, 1)
    assert take(db, run.id, "b") is None


def test_who_holds_a_question_is_told_without_the_name_that_could_change_an_answer(
    db: Database, run: Run, guidance: int, clock: Clock
) -> None:
    assert held(db, run.id).leases == []
    leased(db, run, "secret")
    clock.pass_seconds(20)
    now = held(db, run.id)
    assert now.leases == [{"question": get_query(db, guidance).public_id, "holder": holder("secret")}]
    assert now.ends_in == pytest.approx(LEASE_SECONDS - 20)
    assert "secret" not in str(now)
    assert holder("secret") != holder("another")
    clock.pass_seconds(40)
    assert held(db, run.id).leases == []
