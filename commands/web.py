"""`parenting web`: serve the pages and the API. It never loads torch."""

from __future__ import annotations

import socket
from typing import Annotated

import typer

from parenting.commands.database import require_file, tell_mark
from parenting.commands.errors import friendly_errors, settings
from parenting.commands.options import AfterFd, Public
from parenting.commands.printing import say
from parenting.server.lifeline import follow, wait_at
from parenting.server.listener import bind
from parenting.server.store.private import make_files_private

Port = Annotated[int | None, typer.Option(help="Port to listen on; 0 takes a free one.", show_default="8765")]


def web(
    port: Port = None,
    host: Annotated[
        str | None, typer.Option(help="Address to listen on; one that others reach needs --public.")
    ] = None,
    public: Public = None,
    fd: Annotated[
        int | None, typer.Option(hidden=True, help="A listening socket, from `parenting up`.")
    ] = None,
    after_fd: AfterFd = None,
) -> None:
    """Serve the pages and the API on this machine until Ctrl-C.

    Example: parenting web --port 8000
    """
    follow()
    make_files_private()
    with friendly_errors("web"):
        chosen = settings(port=port, host=host, public=public)
        from parenting.server.serve import make_server  # loads the web's libraries

        wait_at(after_fd)
        require_file(chosen)
        server = make_server(chosen)
        if after_fd is None:  # else `up` tells it
            tell_mark(chosen)
        listener = bind(chosen) if fd is None else socket.socket(fileno=fd)
        if fd is None:
            say(f"Parenting's pages: http://localhost:{listener.getsockname()[1]}/  (Ctrl-C stops them)")
            say("An address that lets a browser in: parenting access open")
        server.run(sockets=[listener])
