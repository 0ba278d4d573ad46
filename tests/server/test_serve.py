"""Where the server listens: on this machine only, and in a container on that container's own network."""

import gc
import socket

import pytest

from parenting.server.db import Database
from parenting.server.errors import SetupError
from parenting.server.listener import bind
from parenting.server.public import address_of
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


def at(host: str, **more: object) -> Settings:
    return Settings.model_validate({"host": host, "port": 0, **more})


def test_this_machine_alone_can_reach_it() -> None:
    with bind(at("127.0.0.1")) as listener:
        assert listener.getsockname()[0] == "127.0.0.1"
        with socket.create_connection(listener.getsockname(), timeout=5):
            pass


@pytest.mark.parametrize("host", ELSEWHERE)
@pytest.mark.usefixtures("deaf")
def test_other_addresses_are_refused_with_the_remedies(host: str) -> None:
    said = (
        r"would let others in over plain http\. Use 127\.0\.0\.1; or --public, .*PUBLISHED_ON_LOOPBACK=true"
    )
    with pytest.raises(SetupError, match=said):
        bind(at(host))


@pytest.mark.usefixtures("deaf")
def test_in_a_container_it_may_listen_on_its_whole_network() -> None:
    for host in ("127.0.0.1", "0.0.0.0"):
        with bind(at(host, port=8765, published_on_loopback=True)) as listener:
            assert isinstance(listener, Listener)
            assert listener.asked == (host, 8765)


@pytest.mark.parametrize("host", ELSEWHERE[1:])
@pytest.mark.usefixtures("deaf")
def test_a_container_changes_nothing_for_any_other_address(host: str) -> None:
    with pytest.raises(SetupError, match="would let others in"):
        bind(at(host, published_on_loopback=True))


@pytest.mark.usefixtures("deaf")
def test_a_public_server_listens_where_it_is_told() -> None:
    for host in ("127.0.0.1", "0.0.0.0", "192.168.1.2"):
        with bind(at(host, public=True, hosts="parenting.example")) as listener:
            assert isinstance(listener, Listener)
            assert listener.asked == (host, 0)


def test_the_address_that_is_printed_is_that_of_the_proxy_where_the_server_is_public() -> None:
    assert address_of(at("127.0.0.1"), 8000) == "http://localhost:8000"
    assert address_of(at("127.0.0.1", hosts="parenting.example"), 8000) == "http://localhost:8000"
    public = at("127.0.0.1", public=True, hosts="Parenting.example, lab.example")
    assert address_of(public, 8000) == "https://parenting.example"


def test_an_address_of_no_interface_is_refused_by_name() -> None:
    with pytest.raises(SetupError, match=r"host: 192\.0\.2\.1 with port 0 cannot be used"):
        bind(at("192.0.2.1", public=True, hosts="parenting.example"))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({}, "PARENTING_HOSTS: a public server has to know"),
        ({"hosts": " , "}, "PARENTING_HOSTS: a public server has to know"),
        (
            {"hosts": "https://parenting.example"},
            "PARENTING_HOSTS: 'https://parenting.example' is not the name",
        ),
        ({"hosts": "parenting.example:443"}, "PARENTING_HOSTS: 'parenting.example:443' is not the name"),
        ({"hosts": "*.example"}, "is not the name of a host"),
        ({"hosts": "a.example", "trusted_proxies": "127.0.0.1, proxy"}, "PROXIES: 'proxy' is neither"),
        ({"hosts": "a.example", "trusted_proxies": "10.0.0.1/24"}, "'10.0.0.1/24' is neither"),
    ],
)
def test_wrong_settings_of_a_public_server_are_named(wrong: dict[str, str], said: str) -> None:
    with pytest.raises(SetupError, match=said):
        bind(at("127.0.0.1", public=True, **wrong))


def test_what_is_loaded_is_not_searched_for_garbage(db: Database, settings: Settings) -> None:
    make_server(settings)
    frozen = gc.get_freeze_count()
    gc.unfreeze()
    assert frozen > 10_000
