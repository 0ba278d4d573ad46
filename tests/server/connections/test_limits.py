"""The connections that are admitted when they are many (E8)."""

import resource

import pytest

from parenting.server.connections import files
from parenting.server.connections.limits import Connections, Limits, is_loopback
from parenting.server.errors import SetupError


class Fake:
    """A connection that is idle or not, and notes its end."""

    def __init__(self, idle: bool) -> None:
        self._idle, self.ended = idle, False

    def idle(self) -> bool:
        return self._idle

    def end(self) -> None:
        self.ended = True


def test_longest_idle_connection_makes_room() -> None:
    connections = Connections(Limits(connections=3))
    busy, first, second = Fake(idle=False), Fake(idle=True), Fake(idle=True)
    assert all(connections.admit(one, "127.0.0.1") for one in (busy, first, second))
    connections.touch(first)  # used since
    assert connections.admit(Fake(idle=False), "127.0.0.1")
    assert (busy.ended, first.ended, second.ended) == (False, False, True)
    assert len(connections) == 3


def test_nobody_is_let_in_while_all_are_at_work() -> None:
    connections = Connections(Limits(connections=1))
    only = Fake(idle=False)
    assert connections.admit(only, "127.0.0.1")
    assert not connections.admit(Fake(idle=True), "127.0.0.1")
    connections.leave(only)
    assert connections.admit(Fake(idle=True), "127.0.0.1")


def test_one_client_cannot_take_the_places_of_all() -> None:
    connections = Connections(Limits(per_client=2))
    held = [Fake(idle=False) for _ in range(2)]
    assert all(connections.admit(one, "192.0.2.1") for one in held)
    assert not connections.admit(Fake(idle=True), "192.0.2.1")
    assert connections.admit(Fake(idle=True), "192.0.2.2")
    connections.leave(held[0])
    assert connections.admit(Fake(idle=True), "192.0.2.1")


def test_own_longest_idle_connection_of_a_client_makes_room() -> None:
    connections = Connections(Limits(per_client=3))
    others, busy, first, second = Fake(idle=True), Fake(idle=False), Fake(idle=True), Fake(idle=True)
    assert connections.admit(others, "192.0.2.2")  # idle for longer, but not its own
    assert all(connections.admit(one, "192.0.2.1") for one in (busy, first, second))
    connections.touch(first)  # used since
    assert connections.admit(Fake(idle=False), "192.0.2.1")
    assert [one.ended for one in (others, busy, first, second)] == [False, False, False, True]
    assert len(connections) == 4
    assert connections.admit(Fake(idle=False), "192.0.2.1")
    assert first.ended
    assert not connections.admit(Fake(idle=False), "192.0.2.1"), "all three are at work"
    assert (others.ended, connections.ended) == (False, 2)


def test_client_at_its_bound_ends_nobody_elses_connection() -> None:
    connections = Connections(Limits(connections=2, per_client=1))
    others, own = Fake(idle=True), Fake(idle=True)
    assert connections.admit(others, "192.0.2.2")
    assert connections.admit(own, "192.0.2.1")
    assert connections.admit(Fake(idle=True), "192.0.2.1")
    assert (others.ended, own.ended) == (False, True)
    assert len(connections) == 2


def test_proxy_on_loopback_speaks_for_many() -> None:
    connections = Connections(Limits(per_client=2))
    assert all(connections.admit(Fake(idle=True), "127.0.0.1") for _ in range(9))


@pytest.mark.parametrize(
    ("client", "yes"), [("127.0.0.1", True), ("::1", True), ("192.0.2.1", False), ("", False)]
)
def test_loopback_is_known(client: str, yes: bool) -> None:
    assert is_loopback(client) is yes


def test_soft_limit_of_files_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    limits = {"now": (1024, 4096)}
    monkeypatch.setattr(resource, "getrlimit", lambda _which: limits["now"])
    monkeypatch.setattr(resource, "setrlimit", lambda _which, pair: limits.update(now=pair))
    assert files.room_for(1000) == 1000
    assert limits["now"] == (4096, 4096)


def test_few_files_mean_few_connections(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda _which: (1024, 1024))
    assert files.room_for(1000) == 1024 - files.RESERVE


def test_too_few_files_are_refused_with_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda _which: (256, 256))
    with pytest.raises(SetupError, match=r"may open 256 files.*ulimit -n 1256"):
        files.room_for(1000)
