"""Commands as processes that start at once.

A server of forks loads torch once, and each command is a fork of it that runs `parenting ...` as a shell
would. All of them stop when the test's process is gone.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from parenting.server.lifeline import VARIABLE
from parenting.server.settings import Settings
from tests.access import seed

PRELOADED = [
    "parenting.commands.main",
    "parenting.commands.answer",
    "parenting.commands.judge",
    "parenting.server.serve",
    "parenting.server.worker_process",
    "tests.server.warmed",
]


@cache
def _context() -> Any:
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    return context


class Command:
    """`parenting ...` as a process; what it prints goes into a file."""

    def __init__(
        self,
        *arguments: str,
        data: Path,
        patches: Mapping[str, Any] | None = None,
        prepare: Callable[[], object] | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """Start it.

        `patches` are set in it alone, by the dotted names of modules' variables; `prepare` is called in it
        first, with the `environment` already set.
        """
        self.arguments = arguments
        seed(data)
        self.output = data / f"{arguments[0]}-{os.urandom(4).hex()}.out"
        there, self._lifeline = _context().Pipe(duplex=False)
        variables = {
            "PARENTING_DATA": str(data),
            "PARENTING_CLAIM_SECONDS": "0.2",
            **(environment or {}),
        }
        self.process = _context().Process(
            target=_run, args=(arguments, variables, str(self.output), there, dict(patches or {}), prepare)
        )
        self.process.start()
        there.close()

    def kill(self) -> None:
        """SIGKILL, and wait until it is gone."""
        os.kill(self.process.pid, signal.SIGKILL)
        self.process.join()

    def stop(self) -> int:
        """SIGTERM; its exit code."""
        self.process.terminate()
        return self.wait(20)

    def wait(self, seconds: float) -> int:
        """Its exit code, once it ends."""
        self.process.join(seconds)
        assert self.process.exitcode is not None, f"{self.arguments} goes on: {self.said()}"
        return int(self.process.exitcode)

    def said(self) -> str:
        """The text that it has printed."""
        return self.output.read_text(encoding="utf-8") if self.output.exists() else ""

    @property
    def alive(self) -> bool:
        return bool(self.process.is_alive())


def store_of(settings: Settings) -> dict[str, str]:
    """The variables by which a process finds the database of these settings, besides its data folder."""
    return {} if settings.database_url is None else {"PARENTING_DATABASE_URL": settings.database_url}


@contextmanager
def command(*arguments: str, settings: Settings, **patches: Any) -> Iterator[Command]:
    """A command on these settings' database that is killed at the end if it still runs."""
    one = Command(*arguments, data=settings.data, patches=patches, environment=store_of(settings))
    try:
        yield one
    finally:
        if one.alive:
            one.kill()


def _run(
    arguments: tuple[str, ...],
    environment: dict[str, str],
    output: str,
    lifeline: Connection,
    patches: dict[str, Any],
    prepare: Callable[[], object] | None,
) -> None:
    file = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    for descriptor in (1, 2):
        os.dup2(file, descriptor)
    os.environ.pop("PARENTING_DATABASE_URL", None)
    os.environ.update(environment | {VARIABLE: str(lifeline.fileno())})
    for name, value in patches.items():
        module, _, variable = name.rpartition(".")
        assert hasattr(sys.modules[module], variable), f"{name} is not there to be replaced"
        setattr(sys.modules[module], variable, value)
    if prepare is not None:
        prepare()
    from parenting.commands.main import app

    app(list(arguments))
