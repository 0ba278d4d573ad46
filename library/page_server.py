"""The program's server as a process of its own, for as long as a person answers."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx2

from parenting.server.access.credentials import Credentials
from parenting.server.lifeline import VARIABLE

START_SECONDS, STOP_SECONDS = 90.0, 15.0
FRAMES = "http://localhost:* http://127.0.0.1:* https://localhost:* vscode-webview:"
"""Where a notebook's page may come from."""


class ServerFailedError(RuntimeError):
    """The server did not start, or ended by itself; the message has its last words."""


@contextmanager
def running_server(data: Path) -> Iterator[subprocess.Popen[str]]:
    """Start `parenting up` on a free port with its data in a folder; stop it in the end.

    It stops, too, when this process ends in whatever way. `address` waits until it is up.
    """
    lifeline, held = os.pipe()
    environment = {
        **os.environ,
        "PARENTING_DATA": str(data),
        "PARENTING_FRAME_ANCESTORS": FRAMES,
        "PYTHONUNBUFFERED": "1",
        VARIABLE: str(lifeline),
    }
    command = [sys.executable, "-P", "-m", "parenting.commands.main", "up", "--port", "0", "--no-browser"]
    with (data / "server.log").open("ab") as log:
        process = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            pass_fds=[lifeline],
            start_new_session=True,  # Ctrl-C reaches us alone: we stop it once everything is saved
        )
    try:
        yield process
    finally:
        _stop(process)
        os.close(lifeline)
        os.close(held)


def address(process: subprocess.Popen[str], data: Path) -> str:
    """Return the server's address once it serves pages and a worker lives.

    Raises:
        ServerFailedError: It did not come up.
    """
    assert process.stdout is not None
    line = process.stdout.readline()
    place = line.find("http://")
    if place < 0:
        raise failure(data)
    url = line[place:].split()[0].partition("/open?")[0]
    end = time.monotonic() + START_SECONDS
    while not is_ready(url):
        if process.poll() is not None or time.monotonic() > end:
            raise failure(data)
        time.sleep(0.05)
    return url


def is_ready(url: str) -> bool:
    """Return whether pages are served and a worker lives."""
    try:
        return httpx2.get(f"{url}/readyz", timeout=5, trust_env=False).status_code == 200
    except httpx2.HTTPError:
        return False


def database_at(url: str, data: Path) -> str | None:
    """Return the UUID of the database that a server has; None if it does not say.

    It says so to whoever can read the key of its data folder, or has a token (PARENTING_TOKEN).
    """
    auth = Credentials(os.environ.get("PARENTING_TOKEN"), data)
    try:
        said = httpx2.get(f"{url}/api/v1/runs?limit=1", timeout=5, trust_env=False, auth=auth).json()
    except (httpx2.HTTPError, ValueError):
        return None
    return str(said["database"]) if isinstance(said, dict) and "database" in said else None


def failure(data: Path) -> ServerFailedError:
    """Return the error that tells what the server said last."""
    log = data / "server.log"
    said = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-5:]
    return ServerFailedError(
        "\n".join(["The server did not come up, or ended by itself.", *said, f"More: {log}"])
    )


def _stop(process: subprocess.Popen[str]) -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(STOP_SECONDS)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    if process.stdout is not None:
        process.stdout.close()
