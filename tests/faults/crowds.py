"""A web process, some workers, and the people of `parenting answer`, as processes of one data folder."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from parenting.server.settings import Settings
from tests.server.processes import Command, store_of
from tests.server.serving import free_port, until_up


@dataclass
class Crowded:
    """The processes; all that still live are killed at the end."""

    settings: Settings
    environment: Mapping[str, str]
    patches: Mapping[str, Any]
    stack: ExitStack
    url: str = field(default_factory=lambda: f"http://127.0.0.1:{free_port()}")
    workers: list[Command] = field(default_factory=list)

    def begin(self, *arguments: str) -> Command:
        """Start a command."""
        one = Command(*arguments, data=self.settings.data, environment=self.environment, patches=self.patches)
        self.stack.callback(partial(_kill, one))
        return one

    def answer(self, *arguments: str) -> Command:
        """Let people answer; see `parenting answer`."""
        return self.begin("answer", "--url", self.url, "--json", *arguments)


@contextmanager
def crowded(
    settings: Settings,
    workers: int,
    environment: Mapping[str, str] | None = None,
    patches: Mapping[str, Any] | None = None,
) -> Iterator[Crowded]:
    """Start the web, which listens by then, and so many workers."""
    with ExitStack() as stack:
        house = Crowded(settings, store_of(settings) | dict(environment or {}), dict(patches or {}), stack)
        house.begin("web", "--port", house.url.rpartition(":")[2])
        house.workers += [house.begin("worker") for _ in range(workers)]
        until_up(house.url)
        yield house


def figures_of(people: Command) -> dict[str, Any]:
    """The figures that people who have ended printed."""
    found: dict[str, Any] = json.loads(people.said().splitlines()[-1])
    return found


def _kill(one: Command) -> None:
    if one.alive:
        one.kill()
