"""Logs of web and worker: quiet unless something is wrong; `PARENTING_LOG_LEVEL=info` shows more."""

from __future__ import annotations

import logging
import sys

import structlog

from parenting.server.errors import SetupError


def set_up_log(level: str) -> None:
    """Set up the log: one line for each message, on standard error.

    Raises:
        SetupError: the level is unknown.
    """
    number = logging.getLevelNamesMapping().get(level.upper())
    if number is None:
        raise SetupError(f"log_level: {level} is not one of debug, info, warning and error.")
    logging.basicConfig(level=number, format="%(levelname)s %(name)s: %(message)s", stream=sys.stderr)
    structlog.configure(
        processors=[
            structlog.contextvars.merge_contextvars,
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso"),
            # plain: the default one prints every local variable, secrets included
            structlog.dev.ConsoleRenderer(
                colors=sys.stderr.isatty(), exception_formatter=structlog.dev.plain_traceback
            ),
        ],
        wrapper_class=structlog.make_filtering_bound_logger(number),
        logger_factory=structlog.PrintLoggerFactory(sys.stderr),
    )
