"""`parenting up`: start everything by one command.

Web and worker are separate processes, so that neither blocks the other. They load their libraries while this
one migrates the database, and begin once it has: a pipe that this process closes tells them.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import Annotated

import typer

from parenting.commands import children
from parenting.commands.children import Child
from parenting.commands.errors import friendly_errors, settings
from parenting.commands.printing import say
from parenting.server.lifeline import follow
from parenting.server.listener import bind
from parenting.server.settings import Settings
from parenting.server.store.private import make_files_private


def up(
    port: Annotated[
        int | None, typer.Option(help="Port of the pages; 0 takes a free one.", show_default="8765")
    ] = None,
    browser: Annotated[bool, typer.Option(help="Open the pages in a browser.")] = True,
) -> None:
    """Migrate the database, start the pages and a worker, and open a browser. Ctrl-C stops everything.

    A process that dies is started again: the pages never go down because a worker died.

    Example: parenting up --port 0 --no-browser
    """
    follow()
    make_files_private()
    with friendly_errors():
        chosen = settings(port=port)
        listener = bind(chosen.host, chosen.port, chosen.container)
        with listener, _signals() as told, _children(listener) as (both, migrated):
            _migrate(chosen)
            migrated()
            _watch(both, told, listener.getsockname()[1], browser)


def _watch(both: Sequence[Child], told: threading.Event, port: int, browser: bool) -> None:
    """Say where the pages are, and keep the processes running until told to stop."""
    url = f"http://localhost:{port}/"
    say(f"Parenting is at {url}  (Ctrl-C stops it)")
    if browser and _has_screen():
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
    try:
        children.watch(both, told)
    except children.RefusedError as error:
        _tell(str(error))
        raise typer.Exit(children.REFUSED) from None


def _migrate(chosen: Settings) -> None:
    from parenting.server.backups.before_migrating import migrate  # loads SQLAlchemy while the others start
    from parenting.server.db import connect

    db = connect(chosen)
    try:
        migrate(db, chosen.data)
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
def _children(listener: socket.socket) -> Iterator[tuple[Sequence[Child], Callable[[], None]]]:
    """Start web and worker, and yield them with what lets them begin.

    A web process that is started again takes the same listening socket.
    """
    started: list[Child] = []
    with children.lifeline() as followed, children.gate() as (gate, opened):
        fd = listener.fileno()
        after = ["--after-fd", str(gate)]
        web = partial(children.start, ["web", "--fd", str(fd), *after], followed, [fd, gate])
        try:
            started.append(Child("web", web, _tell))
            started.append(
                Child("worker", partial(children.start, ["worker", *after], followed, [gate]), _tell)
            )
            yield started, opened
        finally:
            children.stop(started)


def _tell(sentence: str) -> None:
    say(sentence, err=True)


def _has_screen() -> bool:
    """Return whether a browser can open a window; without a screen, some take over the terminal."""
    screens = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform != "linux" or any(os.environ.get(name) for name in screens)
