"""Where the server listens: on this machine only, and in a container on that container's own network."""

import gc
import socket

import pytest

from parenting.server.db import Database
from parenting.server.errors import SetupError
from parenting.server.listener import bind
from parenting.server.serve import make_server
from parenting.server.settings import Settings

ELSEWHERE = ["0.0.0.0", "192.168.1.2", "::", "localhost", ""]


class Listener(socket.socket):
    """Notes where it would listen, and opens nothing: a test lets nobody in."""

    asked: tuple[str, int]

    def bind(self, address: tuple[str, int]) -> None:  # type: ignore[override]
        self.asked = address

    def listen(self, _backlog: int = 0) -> None:
        pass


@pytest.fixture
def deaf(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("parenting.server.listener.socket.socket", Listener)


def test_this_machine_alone_can_reach_it() -> None:
    with bind("127.0.0.1", 0) as listener:
        assert listener.getsockname()[0] == "127.0.0.1"
        with socket.create_connection(listener.getsockname(), timeout=5):
            pass


@pytest.mark.parametrize("host", ELSEWHERE)
@pytest.mark.usefixtures("deaf")
def test_other_addresses_are_refused_with_the_remedy(host: str) -> None:
    with pytest.raises(
        SetupError, match=r"there is no login yet\. Use 127\.0\.0\.1; .*PARENTING_CONTAINER=true"
    ):
        bind(host, 0)


@pytest.mark.usefixtures("deaf")
def test_in_a_container_it_may_listen_on_its_whole_network() -> None:
    for host in ("127.0.0.1", "0.0.0.0"):
        with bind(host, 8765, container=True) as listener:
            assert isinstance(listener, Listener)
            assert listener.asked == (host, 8765)


@pytest.mark.parametrize("host", ELSEWHERE[1:])
@pytest.mark.usefixtures("deaf")
def test_a_container_changes_nothing_for_any_other_address(host: str) -> None:
    with pytest.raises(SetupError, match="would let others in"):
        bind(host, 0, container=True)


def test_what_is_loaded_is_not_searched_for_garbage(db: Database, settings: Settings) -> None:
    make_server(settings)
    frozen = gc.get_freeze_count()
    gc.unfreeze()
    assert frozen > 10_000
