"""Logs of web, worker and `up`: one line a message, for people or as JSON, on standard error or in files.

Quiet unless something is wrong; `PARENTING_LOG_LEVEL=info` shows more. Messages of our own, of uvicorn and of
every other library take the same way: they name the request, the run and the question that they are about,
hide secrets, and a warning that repeats is written once a second.
"""

from __future__ import annotations

import fcntl
import logging
import os
import sys
from io import TextIOWrapper
from logging.handlers import RotatingFileHandler
from pathlib import Path

import structlog
from structlog.stdlib import ProcessorFormatter
from structlog.typing import Processor

from parenting.server.errors import SetupError
from parenting.server.log_lines import Limit, about_request, hide_secrets, on_one_line
from parenting.server.settings import Settings
from parenting.server.store.owner import give

MOST_PROCESSES = 64
_locks: list[int] = []


def set_up_log(settings: Settings, process: str) -> None:
    """Set up the log of this process.

    Args:
        settings: The settings of log level, format and folder.
        process: The kind of this process, web, worker or up, which names its file.

    Raises:
        SetupError: the level is unknown, or the folder cannot be written to.
    """
    number = logging.getLevelNamesMapping().get(settings.log_level.upper())
    if number is None:
        raise SetupError(f"log_level: {settings.log_level} is not one of debug, info, warning and error.")
    before: list[Processor] = [
        structlog.contextvars.merge_contextvars,
        about_request,
        structlog.stdlib.add_log_level,
        structlog.processors.TimeStamper(fmt="iso"),
    ]
    handler = _handler(settings, process)
    handler.setFormatter(_formatter(settings.log_format, process, before))
    handler.addFilter(Limit())
    root = logging.getLogger()
    for old in list(root.handlers):
        if isinstance(old.formatter, ProcessorFormatter):  # of an earlier call
            root.removeHandler(old)
            old.close()
    root.addHandler(handler)
    root.setLevel(number)
    # Of a connection that is lost the refusal speaks; the pool would add a traceback of its reset.
    logging.getLogger("sqlalchemy.pool").setLevel(logging.CRITICAL)
    logging.raiseExceptions = False  # a full disk or a closed pipe loses the line, not the request
    structlog.configure(
        processors=[*before, ProcessorFormatter.wrap_for_formatter],
        wrapper_class=structlog.make_filtering_bound_logger(number),
        logger_factory=structlog.stdlib.LoggerFactory(),
    )


def _formatter(log_format: str, process: str, before: list[Processor]) -> ProcessorFormatter:
    shared: list[Processor] = [ProcessorFormatter.remove_processors_meta]
    if log_format == "json":
        shared += [
            structlog.processors.format_exc_info,
            structlog.processors.CallsiteParameterAdder([structlog.processors.CallsiteParameter.PROCESS]),
            hide_secrets,
            structlog.processors.EventRenamer("message"),
            structlog.processors.JSONRenderer(default=str),
        ]
    else:
        shared += [
            structlog.processors.format_exc_info,  # plain: others print every local variable
            hide_secrets,
            on_one_line,
            structlog.dev.ConsoleRenderer(colors=log_format == "text" and sys.stderr.isatty()),
        ]
    named: list[Processor] = [*before, structlog.stdlib.add_logger_name]
    return ProcessorFormatter(foreign_pre_chain=named, processors=shared)


def _handler(settings: Settings, process: str) -> logging.Handler:
    if settings.log_folder is None:
        return logging.StreamHandler(sys.stderr)
    try:
        settings.log_folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        give(settings.log_folder)
        file = _unshared(settings.log_folder, process)
        return PrivateFiles(file, "a", settings.log_bytes, settings.log_files, "utf-8")
    except OSError as error:
        raise SetupError(
            f"PARENTING_LOG_FOLDER: {settings.log_folder} cannot be written to: {error.strerror}. "
            "Name another folder."
        ) from None


class PrivateFiles(RotatingFileHandler):
    """A handler whose files only their owner can read."""

    def _open(self) -> TextIOWrapper:
        descriptor = _private(self.baseFilename, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        return open(descriptor, "a", encoding="utf-8")


def _unshared(folder: Path, process: str) -> Path:
    """Return a file that no living process writes: two that rotate one file would lose lines."""
    for number in range(1, MOST_PROCESSES + 1):
        name = process if number == 1 else f"{process}-{number}"
        lock = _private(str(folder / f".{name}.lock"), os.O_CREAT | os.O_RDWR)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            continue
        _locks.append(lock)  # held as long as this process lives
        return folder / f"{name}.log"
    raise SetupError(f"PARENTING_LOG_FOLDER: {MOST_PROCESSES} processes write to {folder} already.")


def _private(name: str, flags: int) -> int:
    descriptor = os.open(name, flags, 0o600)
    give(Path(name))
    return descriptor
