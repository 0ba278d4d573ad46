"""The page's address and one line of progress, for a person in a notebook or terminal."""

from __future__ import annotations

import os
import sys
import webbrowser
from typing import Any

HEIGHT = 720
"""Pixels of the page below a notebook's cell."""


def in_notebook() -> bool:
    """Return whether this is a notebook's kernel, by IPython if it is loaded."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return getattr(shell, "kernel", None) is not None


def open_page(url: str, browser: bool) -> None:
    """Print the address; show the page below the cell in a notebook, or open it in a browser."""
    print(f"Answer the agent's questions at {url}")
    if in_notebook():
        display = _display()
        display.display(display.IFrame(url, "100%", HEIGHT))
    elif browser and _has_screen():
        webbrowser.open(url)


class LiveLine:
    """One line that says how far it is: in a notebook, or on a terminal; elsewhere it says nothing."""

    def __init__(self, wanted: bool | None) -> None:
        self._notebook = in_notebook() and wanted is not False
        self._terminal = not self._notebook and (sys.stderr.isatty() if wanted is None else wanted)
        self._handle: Any = None
        self._shown = ""

    def show(self, text: str) -> None:
        """Replace the line."""
        if text == self._shown:
            return
        self._shown = text
        if self._terminal:
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
        elif self._notebook:
            data = {"text/plain": text}
            if self._handle is None:
                self._handle = _display().display(data, raw=True, display_id=True)
            else:
                self._handle.update(data, raw=True)

    def end(self) -> None:
        """Leave the line as it is."""
        if self._terminal and self._shown:
            print(file=sys.stderr)


def _display() -> Any:
    from importlib import import_module

    return import_module("IPython.display")  # there where a notebook is; nothing that we require


def _has_screen() -> bool:
    """Return whether a browser would open a window; without one, some would take over the terminal."""
    names = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform != "linux" or any(os.environ.get(name) for name in names)
