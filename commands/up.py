"""`parenting up`: start everything by one command.

Web and workers are separate processes, so that none blocks another. They load their libraries while this one
migrates the database, and begin once it has: a pipe that this process closes tells them.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import Annotated

import structlog
import typer

from parenting.commands import children
from parenting.commands.children import Child
from parenting.commands.crew import Crew
from parenting.commands.errors import friendly_errors, settings
from parenting.commands.options import Public
from parenting.commands.printing import say
from parenting.commands.sizing import Sizing, most_workers
from parenting.server.lifeline import follow
from parenting.server.listener import bind
from parenting.server.log import set_up_log
from parenting.server.public import address_of
from parenting.server.settings import Settings
from parenting.server.signal_event import SignalEvent
from parenting.server.store.private import make_files_private

log = structlog.get_logger()

MOST_WORKERS = 64
"""A larger number would be a slip of the hand."""


def up(
    port: Annotated[
        int | None, typer.Option(help="Port of the pages; 0 takes a free one.", show_default="8765")
    ] = None,
    browser: Annotated[bool, typer.Option(help="Open the pages in a browser.")] = True,
    workers: Annotated[
        str,
        typer.Option(
            help="How many workers raise the runs. auto: one, and one more each time that runs wait longer "
            "than 100 ms for their turns, up to a core each less one for the pages; an idle one ends after a "
            "minute."
        ),
    ] = "auto",
    public: Public = None,
) -> None:
    """Migrate the database, start the pages and the workers, and open a browser. Ctrl-C stops everything.

    A process that dies is started again: the pages never go down because a worker died.

    Example: parenting up --port 0 --no-browser --workers 2
    """
    number = _number(workers)
    follow()
    make_files_private()
    with friendly_errors("up"):
        chosen = settings(port=port, public=public)
        set_up_log(chosen, "up")
        listener = bind(chosen)
        with listener, _signals() as told, _children(chosen, listener, number or 1) as (web, crew, migrated):
            secret = _migrate(chosen)
            migrated()
            with _sized(crew, chosen, number):
                url = f"{address_of(chosen, listener.getsockname()[1])}/open?token={secret}"
                _watch(web, crew, told, url, browser)


def _number(workers: str) -> int | None:
    """Return the number of workers; None where it follows their load."""
    if workers == "auto":
        return None
    if not workers.isascii() or not workers.isdigit() or not 1 <= int(workers) <= MOST_WORKERS:
        raise typer.BadParameter(
            f"{workers} is neither auto nor a number from 1 to {MOST_WORKERS}.", param_hint="'--workers'"
        )
    return int(workers)


@contextmanager
def _sized(crew: Crew, chosen: Settings, number: int | None) -> Iterator[None]:
    """Let the number of workers follow their load, unless it is fixed or can only be one."""
    most = most_workers()
    if number is not None or most == 1:
        yield
        return
    from parenting.commands.following import follow_load
    from parenting.server.db import connect

    db, ended = connect(chosen), threading.Event()
    following = threading.Thread(target=follow_load, args=(crew, db, Sizing(most), ended), daemon=True)
    following.start()
    try:
        yield
    finally:
        ended.set()  # it ends with this process, at the latest: it only reads


def _watch(web: Child, crew: Crew, told: SignalEvent, url: str, browser: bool) -> None:
    """Say where the pages are, and keep the processes running until told to stop."""
    say(f"Parenting is at {url}  (Ctrl-C stops it)")
    say("The address lets one browser in, once. Another one: parenting access open")
    if browser and _has_screen():
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
    try:
        children.watch([web, crew], told)
    except children.RefusedError as error:
        log.error(str(error))
        raise typer.Exit(children.REFUSED) from None


def _migrate(chosen: Settings) -> str:
    """Bring the database up to date, and return the secret of a token that lets the researcher in."""
    from parenting.commands.database import tell_mark
    from parenting.server.access.roles import Role
    from parenting.server.access.tokens import make
    from parenting.server.backups.before_migrating import migrate  # loads SQLAlchemy while the others start
    from parenting.server.db import connect
    from parenting.server.migrate import require_primary

    db = connect(chosen)
    try:
        require_primary(db)
        tell_mark(chosen)
        migrate(db, chosen.data)
        return make(db, "opening", Role.RESEARCHER, made_by="parenting up").secret
    finally:
        db.close()


@contextmanager
def _signals() -> Iterator[SignalEvent]:
    """Yield an event that Ctrl-C and SIGTERM set; inside this block they do nothing else."""
    told = SignalEvent()

    def tell(_number: int, _frame: FrameType | None) -> None:
        told.set()

    before = {number: signal.signal(number, tell) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield told
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _children(
    chosen: Settings, listener: socket.socket, workers: int
) -> Iterator[tuple[Child, Crew, Callable[[], None]]]:
    """Start web and workers, and yield them with what lets them begin.

    A web process that is started again takes the same listening socket.
    """
    started: list[Callable[[], list[Child]]] = []
    with children.lifeline() as followed, children.gate() as (gate, opened):
        fd = listener.fileno()
        after = ["--after-fd", str(gate)]
        serve = ["web", "--fd", str(fd), *after, *(["--public"] if chosen.public else [])]
        web = partial(children.start, serve, followed, [fd, gate])
        try:
            pages = Child("web", web, log.warning)
            started.append(lambda: [pages])
            crew = Crew(partial(children.start, ["worker", *after], followed, [gate]), log.warning, workers)
            started.append(crew.all)
            yield pages, crew, opened
        finally:
            children.stop([child for these in started for child in these()])


def _has_screen() -> bool:
    """Return whether a browser can open a window; without a screen, some take over the terminal."""
    screens = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform != "linux" or any(os.environ.get(name) for name in screens)
