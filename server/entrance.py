"""The entrance of the web process: under which names and by which ways a request may come in.

A server for this machine takes the names of this machine. A public one (`--public`) takes the names of
`PARENTING_HOSTS` besides, over https only: by way of a proxy that terminates TLS. What the proxy says of its
client (`X-Forwarded-For`, `X-Forwarded-Proto`) is believed from the addresses of `PARENTING_TRUSTED_PROXIES`
alone; `X-Forwarded-Host` from nobody, since a proxy passes `Host` on. None of it says who somebody is: that
is the session's matter.
"""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass

from starlette.datastructures import Headers
from starlette.types import Scope

from parenting.server.errors import ForwardedError, PlainHttpError, ServerError, UnknownHostError
from parenting.server.public import Network, public_hosts, trusted_proxies
from parenting.server.settings import Settings

Address = ipaddress.IPv4Address | ipaddress.IPv6Address

LOCAL = ("localhost", "127.0.0.1", "[::1]")
"""The names of this machine."""
HOST = re.compile(r"([a-z0-9._-]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?", re.ASCII)
"""A `Host` in lower case: a name or an address, and perhaps a port."""
FOR, PROTO = "x-forwarded-for", "x-forwarded-proto"


@dataclass(frozen=True)
class Entrance:
    """The names and ways that one web process accepts. The default is a server for this machine."""

    public: bool = False
    hosts: tuple[str, ...] = ()
    """Names of the public server, besides those of this machine."""
    proxies: tuple[Network, ...] = ()

    @classmethod
    def of(cls, settings: Settings) -> Entrance:
        """Return the entrance that the settings describe.

        Raises:
            SetupError: names the setting that is wrong or missing.
        """
        return cls(settings.public, public_hosts(settings), trusted_proxies(settings))

    def enter(self, scope: Scope) -> ServerError | None:
        """Return the error that refuses a request; else note its client and scheme in its `scope`.

        Behind the proxy, `client` becomes the address that the proxy names, and `scheme` https.
        """
        headers, peer = Headers(scope=scope), _address((scope.get("client") or ("",))[0])
        host = HOST.fullmatch(headers.get("host", "").lower())
        if host is None:
            return UnknownHostError()
        local = host[1] in LOCAL
        if not self.public:
            return None if local else UnknownHostError()
        if self._trusts(peer) and (FOR in headers or PROTO in headers):
            return self._forwarded(scope, headers, host[1])
        # Without a proxy: a program or a browser on the machine itself, whose requests pass no network.
        return None if local and peer is not None and peer.is_loopback else PlainHttpError()

    def _forwarded(self, scope: Scope, headers: Headers, host: str) -> ServerError | None:
        if headers.getlist(PROTO) != ["https"]:
            return PlainHttpError()
        client = self._client(",".join(headers.getlist(FOR)))
        if client is None:
            return ForwardedError()
        scope["client"], scope["scheme"] = (str(client), 0), "https"
        return None if host in self.hosts else UnknownHostError()

    def _client(self, chain: str) -> Address | None:
        """Return the nearest address that is not one of our proxies: what is before it may be a lie.

        Where all are proxies, it is the first: somebody sits at the proxy's machine. None: no address.
        """
        address = None
        for text in reversed(chain.split(",")):
            address = _address(text.strip())
            if address is None or not self._trusts(address):
                break
        return address

    def _trusts(self, address: Address | None) -> bool:
        return address is not None and any(address in network for network in self.proxies)


def _address(text: str) -> Address | None:
    try:
        address = ipaddress.ip_address(text)
    except ValueError:
        return None
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return mapped or address
