"""The listening socket of the pages, opened without the web's libraries: `parenting up` keeps it."""

from __future__ import annotations

import socket

from parenting.server.errors import SetupError

LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"


def bind(host: str, port: int, container: bool = False) -> socket.socket:
    """Open a listening socket, on this machine only, or with `container` on its whole network.

    Raises:
        SetupError: the address would let others in, or the port is taken.
    """
    if host != LOOPBACK and not (container and host == EVERYWHERE):
        raise SetupError(
            f"host: {host} would let others in, and there is no login yet. Use {LOOPBACK}; or, in a "
            f"container whose port is published on loopback only, {EVERYWHERE} and PARENTING_CONTAINER=true."
        )
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        said = error.strerror or "it cannot be used"
        raise SetupError(
            f"port: {port} cannot be used ({said}). Name another one, or 0 for any free one."
        ) from None
    listener.listen(128)
    listener.set_inheritable(True)
    return listener
