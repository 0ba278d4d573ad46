"""The listening socket of the pages, opened without the web's libraries: `parenting up` keeps it."""

from __future__ import annotations

import socket

from parenting.server.errors import SetupError
from parenting.server.public import public_hosts, trusted_proxies
from parenting.server.settings import Settings

LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"


def bind(settings: Settings) -> socket.socket:
    """Open a listening socket at the settings' address: on this machine only, unless they say more.

    Raises:
        SetupError: the address would let others in, or it is taken; or a setting of a public server is wrong.
    """
    public_hosts(settings), trusted_proxies(settings)
    host, port = settings.host, settings.port
    within = settings.published_on_loopback and host == EVERYWHERE
    if host != LOOPBACK and not within and not settings.public:
        raise SetupError(
            f"host: {host} would let others in over plain http. Use {LOOPBACK}; or --public, behind a proxy "
            "that terminates TLS (docs/operations.md); or, in a container whose port is published on "
            f"loopback only, {EVERYWHERE} and PARENTING_PUBLISHED_ON_LOOPBACK=true."
        )
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        said = error.strerror or "it cannot be used"
        if host not in (LOOPBACK, EVERYWHERE):
            raise SetupError(
                f"host: {host} with port {port} cannot be used ({said}). Name an IPv4 address of its own."
            ) from None
        raise SetupError(
            f"port: {port} cannot be used ({said}). Name another one, or 0 for any free one."
        ) from None
    listener.listen(128)
    listener.set_inheritable(True)
    return listener
