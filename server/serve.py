"""The web process: uvicorn, which ends live streams when it is told to stop, and logs that are quiet by default."""

from __future__ import annotations

import logging
import socket
import sys
from types import FrameType

import structlog
import uvicorn
from fastapi import FastAPI

from server.app import create_app
from server.errors import SetupError
from server.settings import Settings

GRACE = 1
"""Seconds that open requests may still take after the signal to stop (whole ones: uvicorn's rule)."""


class Server(uvicorn.Server):
    """uvicorn, which alone would wait for an open stream until its browser goes away."""

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """On SIGTERM and SIGINT: end the streams, then stop as uvicorn does."""
        app = self.config.app
        if isinstance(app, FastAPI):
            app.state.streams.close()
        super().handle_exit(sig, frame)


def bind(host: str, port: int) -> socket.socket:
    """A listening socket on this machine only.

    Raises:
        SetupError: another address than loopback, or a port that is taken.
    """
    if host != "127.0.0.1":
        raise SetupError(f"host: {host} would let others in, and there is no login yet. Use 127.0.0.1.")
    ear = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    ear.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        ear.bind((host, port))
    except OSError as error:
        ear.close()
        said = error.strerror or "it cannot be used"
        raise SetupError(f"port: {port} cannot be used ({said}). Name another one, or 0 for any free one.") from None
    ear.listen(128)
    ear.set_inheritable(True)
    return ear


def serve(settings: Settings, ear: socket.socket) -> None:
    """Answer requests on a listening socket until a signal says stop.

    Raises:
        SetupError: the database cannot be used as it is.
    """
    set_up_log(settings.log_level)
    app = create_app(settings)
    config = uvicorn.Config(
        app,
        log_config=None,
        log_level=settings.log_level,
        access_log=False,
        lifespan="on",
        timeout_graceful_shutdown=GRACE,
        timeout_keep_alive=30,
        server_header=False,
    )
    Server(config).run(sockets=[ear])


def set_up_log(level: str) -> None:
    """Logs of web and worker: one line each on standard error, with the ids of run and query where they are known.

    Raises:
        SetupError: no such level.
    """
    number = logging.getLevelNamesMapping().get(level.upper())
    if number is None:
        raise SetupError(f"log_level: {level} is none of debug, info, warning and error.")
    logging.basicConfig(level=number, format="%(levelname)s %(name)s: %(message)s", stream=sys.stderr)
    structlog.configure(
        processors=[
            structlog.contextvars.merge_contextvars,
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso"),
            structlog.dev.ConsoleRenderer(colors=sys.stderr.isatty()),
        ],
        wrapper_class=structlog.make_filtering_bound_logger(number),
        logger_factory=structlog.PrintLoggerFactory(sys.stderr),
    )
