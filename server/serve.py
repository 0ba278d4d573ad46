"""The web process: uvicorn, with an end to live streams at the signal to stop."""

from __future__ import annotations

import gc
import socket
from types import FrameType

import structlog
import uvicorn
from fastapi import FastAPI

from parenting.server.app import create_app
from parenting.server.connections.files import room_for
from parenting.server.connections.limits import Limits
from parenting.server.connections.protocol import bounded
from parenting.server.errors import SetupError
from parenting.server.heap import share_heaps
from parenting.server.log import set_up_log
from parenting.server.settings import Settings

LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"
log = structlog.get_logger()

GRACE = 1
"""Seconds that open requests may still take after the signal to stop (whole ones: uvicorn's rule)."""


class Server(uvicorn.Server):
    """A uvicorn server that ends open streams first; uvicorn alone would wait for their browsers."""

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """On SIGTERM and SIGINT: end the streams, then stop as uvicorn does."""
        app = self.config.app
        if isinstance(app, FastAPI):
            app.state.streams.close()
        super().handle_exit(sig, frame)


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


def make_server(settings: Settings) -> Server:
    """Make a server that is ready to `run(sockets=[bind(...)])` until a signal stops it.

    Raises:
        SetupError: the database cannot be used as it is.
    """
    share_heaps()
    set_up_log(settings, "web")
    app = create_app(settings)
    if settings.ballast:
        app.state.db.keep_ballast()
    protocol = bounded(_limits(settings))
    app.state.meters.watch_connections(protocol.open_connections)
    config = uvicorn.Config(
        app,
        http=protocol,
        ws="none",
        log_config=None,
        log_level=settings.log_level.lower(),
        access_log=False,
        lifespan="on",
        timeout_graceful_shutdown=GRACE,
        timeout_keep_alive=30,
        server_header=False,
        proxy_headers=False,  # any program of this machine could send X-Forwarded-For
    )
    gc.freeze()  # loaded modules stay: searching them for garbage takes a tenth of a second
    return Server(config)


def _limits(settings: Settings) -> Limits:
    """Return the bounds of connections, as many as the limit of open files has room for."""
    fit = room_for(settings.connections)
    if fit < settings.connections:
        log.warning("few files may be open", connections=fit, wanted=settings.connections)
    return Limits(connections=fit, per_client=settings.connections_per_client)
