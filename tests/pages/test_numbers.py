"""Numbers and names are written in one way on all pages, by the server and by its scripts."""

from __future__ import annotations

import pytest

from parenting.server.languages import Language
from parenting.server.pages.numbers import number
from parenting.server.pages.texts import world_title
from tests.pages.browser_tabs import BrowserTabs

VALUES = (0, 7, 999, 7236, 1234567, -1.0, 0.5, 1.0625, 12345.678, 0.00001234, -0.00987654, 98.76543, 1e6)


def test_scripts_write_numbers_as_the_server_does(tabs: BrowserTabs) -> None:
    page = tabs.open("/practice")
    script = (
        "values => import('/static/numbers.js').then(({ number }) => values.map((value) => number(value)))"
    )
    assert page.evaluate(script, list(VALUES)) == [number(value) for value in VALUES]


@pytest.mark.parametrize(
    ("value", "written"),
    [(7236, "7,236"), (1.0625, "1.063"), (12345.678, "12,350"), (-1.0, "-1"), (None, "–"), (True, "1")],
)
def test_thousands_are_parted_and_four_digits_kept(value: object, written: str) -> None:
    assert number(value) == written


def test_another_language_reads_no_comma() -> None:
    with Language("de").used():
        assert number(7236) == "7\u202f236"


def test_a_world_has_one_title_for_people() -> None:
    assert world_title("unsafe-exploration") == "Unsafe Exploration"
    assert world_title("of-another-package") == "of-another-package"
