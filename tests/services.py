"""Dockerfile and docker-compose.yml, read; and their services as processes, without Docker."""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from tests.access import seed
from tests.tree import ROOT

VARIABLE = re.compile(r"\$\{\w+:-([^}]*)\}")


def read_compose() -> dict[str, Any]:
    """docker-compose.yml, as it is where the environment sets none of its variables."""
    compose = _with_defaults(yaml.safe_load((ROOT / "docker-compose.yml").read_text(encoding="utf-8")))
    assert isinstance(compose, dict)
    return compose


def _with_defaults(part: Any) -> Any:
    if isinstance(part, dict):
        return {name: _with_defaults(value) for name, value in part.items()}
    if isinstance(part, list):
        return [_with_defaults(value) for value in part]
    return VARIABLE.sub(r"\1", part) if isinstance(part, str) else part


def read_dockerfile() -> list[tuple[str, str]]:
    """Its instructions, as (name, the rest of its line), continued lines joined."""
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    lines = re.sub(r"^\s*#.*\n", "", text, flags=re.MULTILINE).replace("\\\n", " ").splitlines()
    return [(name, rest.strip()) for name, _, rest in (line.partition(" ") for line in lines) if name]


def image_environment() -> dict[str, str]:
    """The variables that ENV sets."""
    pairs = [pair.split("=", 1) for name, rest in read_dockerfile() if name == "ENV" for pair in rest.split()]
    return dict(pairs)


def image_check() -> list[str]:
    """The command of HEALTHCHECK."""
    (rest,) = [rest for name, rest in read_dockerfile() if name == "HEALTHCHECK"]
    return ["CMD", *json.loads(rest.partition(" CMD ")[2])]


class Stack:
    """The services on a data folder and a port of this machine."""

    def __init__(self, data: Path, **instead: str) -> None:
        self.compose = read_compose()
        seed(data)
        self.data, self.instead = data, {"PARENTING_DATA": str(data), **instead}

    def environment(self, service: str) -> dict[str, str]:
        """The environment that the service would have in its container, with this test's own settings."""
        outer = {name: value for name, value in os.environ.items() if not name.startswith("PARENTING_")}
        path = os.pathsep.join([str(Path(sys.executable).parent), outer.get("PATH", os.defpath)])
        own = self.compose["services"][service]["environment"]
        return {**outer, "PATH": path, **image_environment(), **own, **self.instead}

    @contextmanager
    def service(self, name: str, before: Sequence[str] = ()) -> Iterator[subprocess.Popen[bytes]]:
        """Its very command, killed at the end if it still runs; `before` is a command that runs it."""
        command = [*before, *self.compose["services"][name]["command"]]
        child = subprocess.Popen(command, env=self.environment(name), cwd=self.data)
        try:
            yield child
        finally:
            child.kill()
            child.wait()

    def check(self, name: str, before: Sequence[str] = ()) -> int:
        """The exit code of its very health check."""
        kind, *command = self.compose["services"][name]["healthcheck"]["test"]
        assert kind == "CMD"
        return subprocess.run(
            [*before, *command], env=self.environment(name), cwd=self.data, capture_output=True
        ).returncode

    def until_healthy(self, name: str, before: Sequence[str] = (), seconds: float = 60) -> None:
        """Wait until its health check passes."""
        end = time.monotonic() + seconds
        while self.check(name, before) != 0:
            assert time.monotonic() < end, f"{name} did not become healthy"
            time.sleep(1)  # the worker's check alone takes a second of work
