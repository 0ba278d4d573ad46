"""Names of keys on keyboards of several layouts: letters as printed, digits by position."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser

from tests.tree import ROOT

LAYOUTS = {
    "QWERTY": {"KeyA": "a", "KeyB": "b", "KeyE": "e", "KeyN": "n", "Digit1": "1", "Digit2": "2"},
    "QWERTZ": {"KeyA": "a", "KeyB": "b", "KeyE": "e", "KeyN": "n", "Digit1": "1", "Digit2": "2"},
    "AZERTY": {"KeyQ": "a", "KeyB": "b", "KeyE": "e", "KeyN": "n", "Digit1": "&", "Digit2": "é"},
    "Dvorak": {"KeyA": "a", "KeyN": "b", "KeyD": "e", "KeyL": "n", "Digit1": "1", "Digit2": "2"},
    "Persian": {"KeyA": "ش", "KeyB": "ذ", "KeyE": "ث", "KeyN": "د", "Digit1": "\u06f1", "Digit2": "\u06f2"},
    "Russian": {"KeyA": "ф", "KeyB": "и", "KeyE": "\u0443", "KeyN": "т", "Digit1": "1", "Digit2": "2"},
    "numeric pad": {"Numpad1": "1", "Numpad2": "2"},
}
"""The keys that answer, by their position, with the characters that they give."""
OTHERS = {
    ("KeyA", "q"): "q",  # AZERTY: the place of A on QWERTY
    ("KeyE", "."): ".",  # Dvorak
    ("KeyN", "ñ"): "ñ",
    ("Numpad1", "End"): "End",  # without NumLock
    ("Numpad2", "ArrowDown"): "ArrowDown",
    ("Slash", "?"): "?",
    ("KeyA", "A"): "a",  # with Caps Lock
}


@pytest.fixture(scope="module")
def names(browser: Browser) -> dict[tuple[str, str], str]:
    """The names of all these keys, found by one page."""
    keys = [(code, key) for layout in LAYOUTS.values() for code, key in layout.items()] + list(OTHERS)
    source = (ROOT / "web/static/key_names.js").read_text("utf-8").replace("export ", "")
    named = "new KeyboardEvent('keydown', { code, key })"
    script = f"keys => {{ {source}\nreturn keys.map(([code, key]) => keyName({named})); }}"
    page = browser.new_page()
    found: list[str] = page.evaluate(script, [list(pair) for pair in keys])
    page.close()
    return dict(zip(keys, found, strict=True))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_keys_of_the_answers_are_those_that_are_printed(
    names: dict[tuple[str, str], str], layout: str
) -> None:
    found = "".join(names[pair] for pair in LAYOUTS[layout].items())
    assert found == ("12" if layout == "numeric pad" else "aben12")


def test_other_keys_keep_their_names(names: dict[tuple[str, str], str]) -> None:
    assert {pair: names[pair] for pair in OTHERS} == OTHERS
