"""`parenting up`: start everything by one command.

Web and worker are separate processes, so that neither blocks the other.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
import webbrowser
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Annotated

import typer

from parenting.commands.errors import friendly_errors, settings
from parenting.server.db import connect
from parenting.server.lifeline import VARIABLE, follow
from parenting.server.migrate import upgrade
from parenting.server.serve import bind
from parenting.server.settings import Settings

STOP_SECONDS = 1.6
"""Seconds that web and worker get to stop by themselves. Killed after that, they lose nothing."""

Children = Mapping[str, subprocess.Popen[bytes]]


def up(
    port: Annotated[
        int | None, typer.Option(help="Port of the pages; 0 takes a free one.", show_default="8765")
    ] = None,
    browser: Annotated[bool, typer.Option(help="Open the pages in a browser.")] = True,
) -> None:
    """Migrate the database, start the pages and a worker, and open a browser. Ctrl-C stops everything.

    Example: parenting up --port 0 --no-browser
    """
    follow()
    with friendly_errors():
        chosen = settings(port=port)
        listener = bind(chosen.host, chosen.port, chosen.container)
        _migrate(chosen)
    with _signals() as told, _children(listener) as children:
        url = f"http://localhost:{listener.getsockname()[1]}/"
        listener.close()
        typer.echo(f"Parenting is at {url}  (Ctrl-C stops it)")
        if browser and _has_screen():
            threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
        dead = _first_to_end(children, told)
    if dead is not None:
        typer.echo(
            f"The {dead} process ended by itself ({_how(children[dead].returncode)}), so all was stopped.",
            err=True,
        )
        raise typer.Exit(1)


def _migrate(chosen: Settings) -> None:
    db = connect(chosen)
    try:
        upgrade(db)
    finally:
        db.close()


@contextmanager
def _signals() -> Iterator[threading.Event]:
    """Yield an event that Ctrl-C and SIGTERM set; inside this block they do nothing else."""
    told = threading.Event()

    def tell(_number: int, _frame: FrameType | None) -> None:
        told.set()

    before = {number: signal.signal(number, tell) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield told
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _children(listener: socket.socket) -> Iterator[Children]:
    """Start web and worker in sessions of their own: Ctrl-C reaches `up` alone, which stops both."""
    lifeline, held = os.pipe()
    web = ["web", "--fd", str(listener.fileno())]
    children: dict[str, subprocess.Popen[bytes]] = {}
    try:
        children["web"] = _start(web, lifeline, [listener.fileno()])
        children["worker"] = _start(["worker"], lifeline, [])
        yield children
    finally:
        _stop(children)
        os.close(lifeline)
        os.close(held)


def _start(arguments: Sequence[str], lifeline: int, descriptors: Sequence[int]) -> subprocess.Popen[bytes]:
    # With -P, Python does not look for packages in the current folder: a project of the user's may have a
    # package of our name there.
    command = [sys.executable, "-P", "-m", "parenting.commands.main", *arguments]
    environment = {**os.environ, VARIABLE: str(lifeline)}
    return subprocess.Popen(
        command,
        env=environment,
        pass_fds=[lifeline, *descriptors],
        stdin=subprocess.DEVNULL,
        start_new_session=True,
    )


def _first_to_end(children: Children, told: threading.Event) -> str | None:
    """Return the name of the first process that ends, or None if the event is set before."""
    while not told.wait(0.1):
        for name, child in children.items():
            if child.poll() is not None:
                return name
    return None


def _stop(children: Children) -> None:
    for child in children.values():
        if child.poll() is None:
            child.terminate()
    end = time.monotonic() + STOP_SECONDS
    for child in children.values():
        try:
            child.wait(max(0.0, end - time.monotonic()))
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()


def _has_screen() -> bool:
    """Return whether a browser can open a window; without a screen, some take over the terminal."""
    screens = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform != "linux" or any(os.environ.get(name) for name in screens)


def _how(code: int) -> str:
    return f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
