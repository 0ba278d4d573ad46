"""The web process: uvicorn, with an end to live streams at the signal to stop."""

from __future__ import annotations

import gc
import logging
import sys
from types import FrameType

import structlog
import uvicorn
from fastapi import FastAPI

from parenting.envs import registry
from parenting.server.app import create_app
from parenting.server.connections.files import room_for
from parenting.server.connections.limits import Limits
from parenting.server.connections.protocol import bounded
from parenting.server.heap import share_heaps
from parenting.server.log import set_up_log
from parenting.server.public import trusted_proxies
from parenting.server.settings import Settings

log = structlog.get_logger()

GRACE = 1
"""Seconds that open requests may still take after the signal to stop (whole ones: uvicorn's rule)."""


SWITCH_SECONDS = 0.001
"""A thread that waits for Python's lock gets it after so long: one that stores takes it after each statement,
and with Python's 5 ms it would hold the store's lock for that long each time the event loop is busy."""


def expected(record: logging.LogRecord) -> bool:
    """Have the log take requests that the end of the process cuts off for what they are: no error."""
    if str(record.msg).startswith("Cancel %s running task"):
        record.levelno, record.levelname = logging.WARNING, "WARNING"
    return True


class Server(uvicorn.Server):
    """A uvicorn server that ends open streams first; uvicorn alone would wait for their browsers."""

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """On SIGTERM and SIGINT: end the streams, then stop as uvicorn does."""
        app = self.config.app
        if isinstance(app, FastAPI):
            app.state.streams.close()
        super().handle_exit(sig, frame)


def make_server(settings: Settings) -> Server:
    """Make a server that is ready to `run(sockets=[...])` until a signal stops it.

    Raises:
        SetupError: the database cannot be used as it is.
    """
    sys.setswitchinterval(SWITCH_SECONDS)
    share_heaps()
    set_up_log(settings, "web")
    logging.getLogger("uvicorn.error").addFilter(expected)
    for broken in registry.INSTALLED.broken().values():
        log.warning(broken)
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
        proxy_headers=False,  # `server.entrance` reads them
    )
    gc.freeze()  # loaded modules stay: searching them for garbage takes a tenth of a second
    return Server(config)


def _limits(settings: Settings) -> Limits:
    """Return the bounds of connections, as many as the limit of open files has room for."""
    fit = room_for(settings.connections)
    if fit < settings.connections:
        log.warning("few files may be open", connections=fit, wanted=settings.connections)
    return Limits(
        connections=fit, per_client=settings.connections_per_client, proxies=trusted_proxies(settings)
    )
