"""The language of a page: the one that the browser asks for, if its catalogue is installed."""

from __future__ import annotations

from pathlib import Path

import pytest

from parenting.drawing.sentences import mark, tr, trn
from parenting.server.errors import Conflict, NotFound
from parenting.server.languages import Languages
from scripts.catalogue import TEMPLATE, compile_language, pseudo, template


@pytest.fixture
def languages(tmp_path: Path) -> Languages:
    for tag in ("de", "ar-XB", "pt-BR"):
        compile_language(pseudo(tag), tmp_path / tag)
    return Languages(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("accepted", "tag"),
    [
        ("", "en"),
        ("de", "de"),
        ("de-AT,de;q=0.9", "de"),
        ("en-US,en;q=0.9,de;q=0.8", "en"),
        ("fr, de;q=0.5, en;q=0.7", "en"),
        ("fr;q=0.9,DE;q=0.8", "de"),
        ("AR-xb", "ar-XB"),
        ("de;q=0, pt-br;q=0.1", "pt-BR"),
        ("de;q=many, *", "en"),
        (",;q=1,,", "en"),
    ],
)
def test_the_most_wanted_language_that_is_there(languages: Languages, accepted: str, tag: str) -> None:
    assert languages.choose(accepted).tag == tag


def test_english_needs_no_catalogue() -> None:
    english = Languages().choose("de")
    assert (english.tag, english.scripts, english.direction) == ("en", "", "ltr")


@pytest.mark.slow
def test_sentences_are_said_in_the_language_in_use(languages: Languages) -> None:
    said = mark("{name} passes here."), "All else is land."
    with languages.choose("de").used():
        assert tr(said[0], name="A") == "A þååššééš ĥééŕéé."
        assert tr(said[1]) == "Ååļļ ééļšéé îîš ļååñð."
        assert [trn("{count} step", "{count} steps", count) for count in (1, 2)] == [
            "1 šţéþ".replace("é", "éé"),
            "2 šţééþš",
        ]
        assert tr("Not in the catalogue: {x}", x=1) == "Not in the catalogue: 1"
        assert tr("") == ""
    assert tr(said[1]) == said[1]
    assert [languages.choose(tag).direction for tag in ("de", "ar-XB")] == ["ltr", "rtl"]


def test_errors_are_told_in_it_and_logged_in_english(languages: Languages) -> None:
    errors = NotFound(), Conflict("{name} passes here.", name="A")
    with languages.choose("de").used():
        told = [error.told for error in errors]
        bodies = [error.body()["error"]["message"] for error in errors]
    assert told == bodies == ["Ţĥîîš ååððŕééšš ðööééš ñööţ ééẋîîšţ.", "A þååššééš ĥééŕéé."]
    assert [error.message for error in errors] == ["This address does not exist.", "A passes here."]


def test_the_template_holds_the_sentences_of_today() -> None:
    assert TEMPLATE.read_bytes() == template(), "make catalogue"
