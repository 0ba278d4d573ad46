"""The settings of a public server: the names under which it is reached, and the proxies that it believes."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterator

from parenting.server.errors import SetupError
from parenting.server.settings import Settings

Network = ipaddress.IPv4Network | ipaddress.IPv6Network

_LABEL = "[a-z0-9]([a-z0-9-]*[a-z0-9])?"
NAME = re.compile(rf"(?=.{{1,253}}$){_LABEL}(\.{_LABEL})*", re.ASCII)
"""The name of a host, in lower case."""


def public_hosts(settings: Settings) -> tuple[str, ...]:
    """Return the names of a public server; a server for this machine has none.

    Raises:
        SetupError: a name is not one, or the public server has none.
    """
    if not settings.public:
        return ()
    names = tuple(_listed(settings.hosts))
    if not names:
        raise SetupError(
            "PARENTING_HOSTS: a public server has to know the names under which it is reached. For example: "
            "PARENTING_HOSTS=parenting.example"
        )
    for name in names:
        if NAME.fullmatch(name) is None:
            raise SetupError(
                f"PARENTING_HOSTS: '{name}' is not the name of a host. Write names without https:// and "
                "without a port, joined by commas."
            )
    return names


def address_of(settings: Settings, port: int) -> str:
    """Return the address at which a browser reaches the pages: of a public server, by way of its proxy.

    Raises:
        SetupError: see `public_hosts`.
    """
    names = public_hosts(settings)
    return f"https://{names[0]}" if names else f"http://localhost:{port}"


def trusted_proxies(settings: Settings) -> tuple[Network, ...]:
    """Return the addresses of a public server's proxies; a server for this machine believes none.

    Raises:
        SetupError: one of them is not an address.
    """
    return tuple(_network(text) for text in _listed(settings.trusted_proxies)) if settings.public else ()


def _listed(text: str) -> Iterator[str]:
    return (part.strip().lower() for part in text.split(",") if part.strip())


def _network(text: str) -> Network:
    try:
        return ipaddress.ip_network(text)
    except ValueError:
        raise SetupError(
            f"PARENTING_TRUSTED_PROXIES: '{text}' is neither an address, such as 127.0.0.1, nor a network, "
            "such as 10.0.0.0/24."
        ) from None
