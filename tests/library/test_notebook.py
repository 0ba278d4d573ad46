"""In a notebook: the page below the cell, one line that moves, and nothing of it elsewhere."""

from __future__ import annotations

import sys
import webbrowser
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

import parenting as pt
from parenting.library import notebook


class Handle:
    def __init__(self, shown: list[Any]) -> None:
        self.shown = shown

    def update(self, data: dict[str, str], raw: bool) -> None:
        assert raw
        self.shown.append(("update", data["text/plain"]))


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """A pretended kernel: what it was asked to display."""
    found: list[Any] = []
    ipython, display = ModuleType("IPython"), ModuleType("IPython.display")
    ipython.get_ipython = lambda: SimpleNamespace(kernel=object())  # type: ignore[attr-defined]

    def show(thing: Any, raw: bool = False, display_id: bool = False) -> Handle:
        found.append(thing)
        return Handle(found)

    display.display = show  # type: ignore[attr-defined]
    display.IFrame = lambda url, width, height: ("IFrame", url)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    return found


def test_the_page_shows_below_the_cell(shown: list[Any], capsys: pytest.CaptureFixture[str]) -> None:
    notebook.open_page("http://localhost:1234/runs/1/parent", browser=True)
    assert shown == [("IFrame", "http://localhost:1234/runs/1/parent")]
    assert "http://localhost:1234/runs/1/parent" in capsys.readouterr().out


def test_the_line_is_one_output_that_is_replaced(shown: list[Any]) -> None:
    line = notebook.LiveLine(None)
    for text in ("waits", "waits", "explores"):
        line.show(text)
    line.end()
    assert shown == [{"text/plain": "waits"}, ("update", "explores")]


def test_a_terminal_without_a_kernel_is_no_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    ipython = ModuleType("IPython")
    ipython.get_ipython = lambda: SimpleNamespace()  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    assert not notebook.in_notebook()
    monkeypatch.setitem(sys.modules, "IPython", None)
    assert not notebook.in_notebook()


def test_elsewhere_the_address_is_printed_and_a_browser_opens_where_there_is_a_screen(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    notebook.open_page("http://localhost:1", browser=True)
    assert opened == []
    monkeypatch.setenv("DISPLAY", ":0")
    notebook.open_page("http://localhost:2", browser=True)
    notebook.open_page("http://localhost:3", browser=False)
    assert opened == ["http://localhost:2"]
    assert capsys.readouterr().out.count("Answer the agent's questions at") == 3


def test_the_line_moves_on_a_terminal_and_is_silent_in_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    for wanted, speaks in ((True, True), (None, False), (False, False)):
        line = notebook.LiveLine(wanted)
        line.show("tick 3")
        line.end()
        assert ("tick 3" in capsys.readouterr().err) is speaks


def test_training_shows_one_line_that_ends_with_all_trials(shown: list[Any]) -> None:
    pt.train("unsafe-exploration", trials=2, until="ticks:60")
    assert shown[0] == {"text/plain": "0 of 2 trials done, tick 1, 0 answers"}
    assert shown[-1][1].startswith("2 of 2 trials done, tick 60")
    assert len(shown) < 12
    before = len(shown)
    pt.train("unsafe-exploration", until="ticks:2", progress=False)
    assert len(shown) == before
