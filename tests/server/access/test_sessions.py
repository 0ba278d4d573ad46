"""Tokens and sessions: entered once, one seat a link, revoked, expired; nothing but hashes is stored."""

from __future__ import annotations

from datetime import timedelta
from threading import Barrier, Thread

import pytest
from sqlalchemy import select

from parenting.server.access import sessions, tokens
from parenting.server.access.lookup import find
from parenting.server.access.roles import Principal, Role
from parenting.server.access.secret import digest
from parenting.server.access.tables import AccessSession, AccessToken
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError, NotFound, UsedUpError
from parenting.server.tables import Run
from tests.server.conftest import Clock

DAY = 24 * 3600.0
WEEK = timedelta(days=7)


def known(db: Database, secret: str, way: str = "session") -> Principal | None:
    with db.read() as session:
        found = find(session, way, digest(secret), db.clock(), WEEK)  # type: ignore[arg-type]
    return None if found is None else found.principal


def test_an_opening_token_lets_one_browser_in_once(db: Database) -> None:
    made = tokens.make(db, "opening", Role.RESEARCHER)
    assert sessions.require_valid(db, made.secret).id == made.token.id
    entered = sessions.enter(db, made.secret)
    who = known(db, entered.secret)
    assert who is not None
    assert (who.role, who.way, who.run, who.bound) == (Role.RESEARCHER, "session", None, False)
    with pytest.raises(UsedUpError):
        sessions.enter(db, made.secret)
    with pytest.raises(UsedUpError):
        sessions.require_valid(db, made.secret)
    assert known(db, entered.secret) == who, "the replay ended nobody's session"


def test_many_at_once_enter_once(db: Database) -> None:
    made = tokens.make(db, "opening", Role.RESEARCHER)
    together, got = Barrier(4), []

    def enter() -> None:
        together.wait()
        try:
            got.append(sessions.enter(db, made.secret).secret)
        except UsedUpError:
            got.append("")

    threads = [Thread(target=enter) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len([secret for secret in got if secret]) == 1


def test_a_link_has_one_seat_and_one_name(db: Database, run: Run) -> None:
    link = tokens.make(db, "link", Role.PARENT, run=run.id, name="Ada")
    first = sessions.enter(db, link.secret)
    second = sessions.enter(db, link.secret)
    assert known(db, first.secret) is None, "whoever opens it last has the seat"
    who = known(db, second.secret)
    assert who is not None
    assert (who.run, who.run_public_id, who.name, who.client) == (
        run.id,
        run.public_id,
        "Ada",
        link.token.client_id,
    )
    assert who.bound
    assert (who.reaches_run(run.id), who.reaches_run(run.public_id), who.reaches_run(str(run.id))) == (
        True,
    ) * 3
    assert not who.reaches_run(run.id + 1)


def test_who_enters_again_gets_another_secret_and_the_former_session_ends(db: Database) -> None:
    first = sessions.enter(db, tokens.make(db, "opening", Role.RESEARCHER).secret)
    again = sessions.enter(db, tokens.make(db, "opening", Role.VIEWER).secret, former=first.secret)
    assert again.secret != first.secret
    assert known(db, first.secret) is None
    assert known(db, again.secret) is not None


def test_a_planted_cookie_becomes_nobodys_session(db: Database) -> None:
    """Session fixation: the secret that a browser brings is never the one that it leaves with."""
    planted = "ps_" + "A" * 43
    sessions.enter(db, tokens.make(db, "opening", Role.RESEARCHER).secret, former=planted)
    assert known(db, planted) is None


def test_it_ends_by_its_age_without_use_and_by_being_ended(db: Database, clock: Clock) -> None:
    one = sessions.enter(db, tokens.make(db, "opening", Role.RESEARCHER).secret, days=8)
    other = sessions.enter(db, tokens.make(db, "opening", Role.RESEARCHER).secret)
    sessions.end(db, other.secret)
    assert known(db, other.secret) is None
    clock.pass_seconds(6 * DAY)
    assert known(db, one.secret) is not None
    with db.write() as session:
        session.get_one(AccessSession, one.session.id).last_used = db.clock()
    clock.pass_seconds(1.9 * DAY)
    assert known(db, one.secret) is not None
    clock.pass_seconds(0.2 * DAY)
    assert known(db, one.secret) is None, "eight days are over, whatever was done"
    idle = sessions.enter(db, tokens.make(db, "opening", Role.RESEARCHER).secret)
    clock.pass_seconds(7 * DAY)
    assert known(db, idle.secret) is None, "nobody used it for a week"


def test_tokens_expire_and_are_revoked(db: Database, clock: Clock, run: Run) -> None:
    made = tokens.make(db, "opening", Role.RESEARCHER, days=0.5)
    program = tokens.make(db, "program", Role.VIEWER, run=run.id, days=1)
    link = tokens.make(db, "link", Role.PARENT, run=run.id, days=2)
    seat = sessions.enter(db, link.secret)
    who = known(db, program.secret, "token")
    assert who is not None
    assert (who.role, who.way, who.run, who.bound) == (Role.VIEWER, "token", run.id, False)
    clock.pass_seconds(0.6 * DAY)
    with pytest.raises(UsedUpError):
        sessions.enter(db, made.secret)
    clock.pass_seconds(0.5 * DAY)
    assert known(db, program.secret, "token") is None
    assert known(db, seat.secret) is not None
    tokens.revoke(db, link.token.public_id)
    assert known(db, seat.secret) is None, "whoever came in by the link is out"
    with pytest.raises(UsedUpError):
        sessions.enter(db, link.secret)
    with pytest.raises(NotFound):
        tokens.revoke(db, "nobody")


def test_a_secret_of_another_kind_opens_nothing(db: Database) -> None:
    program = tokens.make(db, "program", Role.RESEARCHER)
    with pytest.raises(UsedUpError):
        sessions.enter(db, program.secret)
    assert known(db, program.secret, "session") is None
    opening = tokens.make(db, "opening", Role.RESEARCHER)
    assert known(db, opening.secret, "token") is None


def test_a_parents_token_names_a_run_and_days_are_days(db: Database) -> None:
    with pytest.raises(InvalidFieldsError, match="run"):
        tokens.make(db, "link", Role.PARENT)
    with pytest.raises(InvalidFieldsError, match="days"):
        tokens.make(db, "program", Role.VIEWER, days=0)
    with pytest.raises(NotFound):
        tokens.make(db, "link", Role.PARENT, run=99)
    assert tokens.list_tokens(db, all_of_them=True) == []


def test_no_secret_is_stored(db: Database, run: Run) -> None:
    made = [
        tokens.make(db, "opening", Role.RESEARCHER),
        tokens.make(db, "program", Role.VIEWER),
        tokens.make(db, "link", Role.PARENT, run=run.id),
    ]
    secrets = [one.secret for one in made] + [sessions.enter(db, made[0].secret).secret]
    with db.read() as session:
        rows = [*session.scalars(select(AccessToken)), *session.scalars(select(AccessSession))]
    assert len(rows) == 4
    stored = " ".join(str(value) for row in rows for value in vars(row).values())
    assert [secret for secret in secrets if secret in stored or secret[3:] in stored] == []


def test_ended_ones_leave_the_lists(db: Database, run: Run) -> None:
    link = tokens.make(db, "link", Role.PARENT, run=run.id)
    sessions.enter(db, link.secret)
    sessions.enter(db, tokens.make(db, "opening", Role.RESEARCHER).secret)
    assert [len(tokens.list_tokens(db)), len(sessions.list_sessions(db))] == [1, 2]
    sessions.end_all(db, Role.RESEARCHER)
    assert [one.role for one in sessions.list_sessions(db)] == ["parent"]
    sessions.end_all(db)
    assert sessions.list_sessions(db) == []
    assert [len(tokens.list_tokens(db, True)), len(sessions.list_sessions(db, True))] == [2, 2]
