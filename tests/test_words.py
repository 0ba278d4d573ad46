"""Words that this repository does not use, each with the standard term to write instead."""

import ast
import re
from pathlib import Path

import pytest

from tests.tree import ROOT, git_files

COMPARED = "longer|more|less|fewer|better|worse|faster|slower|larger|smaller|cheaper"
"""The English that \"is no\" is kept for; so is \"there is no\"."""
BANNED = {
    r"lest": "so that ... not",
    r"anew": "again",
    r"dear(er|est)?": "expensive, slow",
    r"weather": "environment noise",
    r"dice": "rng, generator",
    r"nursery": "BatchTrainer, training",
    r"pupils?": "agent, train_state",
    r"labour": "work, executor",
    r"elders?": "frozen policies",
    r"brains?": "network",
    r"by turns": "alternating, in rotation",
    r"as far as can be": "at an infinite distance",
    r"for ever": "forever, without end",
    rf"(is|are) no (?!({COMPARED})\b)[a-z]+": "is not a",
}
"""A pattern of whole words, in any case, and the standard term. A space stands for a line's end too."""
OPENING = re.compile(r"(What|How|Whether|Who|Whose|Whoever|Whom|Which)\b")
"""A docstring begins with an imperative or a noun instead: "Return True if", "The number of"."""
EXEMPT = {
    ("agent/state.py", "elders"): "a name in checkpoints of version 0.1.0, which are still read",
    ("drawing/style/board.css", "pupil"): "that of an eye",
}
THERE = re.compile(r"\bthere\s+$", re.IGNORECASE)
SPACE = r"\s+(?:[#>*/-]+\s+)?"


def sources(*endings: str) -> list[str]:
    """Return the names of the repository's texts, but for this one, the old entries and stored data."""
    out = {"CHANGELOG.md", "tests/test_words.py"}
    names = [name for name in git_files() if name.endswith(endings) and name not in out]
    return [name for name in names if not name.startswith("tests/old/") and (ROOT / name).is_file()]


def read(name: str) -> str:
    return Path(ROOT / name).read_text(encoding="utf-8")


def banned(text: str) -> list[tuple[int, str, str]]:
    """Find the banned words of a text: line, words, standard term."""
    return sorted(
        (text.count("\n", 0, found.start()) + 1, " ".join(found.group().split()), standard)
        for words, standard in BANNED.items()
        for found in re.finditer(rf"\b{words.replace(' ', SPACE)}\b", text, re.IGNORECASE)
        if not THERE.search(text, found.start() - 20, found.start())
    )


def openings(source: str) -> list[tuple[int, str]]:
    """Find the docstrings of a source, those of constants included, that begin as a question does."""
    strings = (
        (node.lineno, node.value.value)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    )
    return [(line, text) for line, text in strings if isinstance(text, str) and OPENING.match(text.strip())]


def test_no_banned_word() -> None:
    """The message names the standard term."""
    found = [
        f"{name}:{line}: {words!r}; write: {standard}"
        for name in sources(".py", ".md", ".html", ".js", ".css", ".toml", ".yml", "Makefile", ".ci/run")
        for line, words, standard in banned(read(name))
        if (name, words.lower()) not in EXEMPT
    ]
    assert found == []


def test_no_docstring_begins_as_a_question() -> None:
    found = [
        f"{name}:{line}: {text.strip().splitlines()[0]}"
        for name in sources(".py")
        for line, text in openings(read(name))
    ]
    assert found == []


def test_every_exemption_is_needed() -> None:
    for name, words in EXEMPT:
        assert words in {found.lower() for _, found, _ in banned(read(name))}, (name, words)


@pytest.mark.parametrize(
    "text",
    [
        "It waits for ever.",
        "It waits for\never.",
        "    # drawn for\n    # ever",
        "A bump is no press.",
        "Boxes are no\n  walls.",
        "Dear to compute.",
        "Lest it fail",
        "This is no longest path.",
    ],
)
def test_banned_words_are_found(text: str) -> None:
    assert len(banned(text)) == 1


@pytest.mark.parametrize(
    "text",
    [
        "There is no wall.",
        "there are\nno boxes",
        "It is no longer here.",
        "Two are no slower than one.",
        "The answer is *no*.",
        "is not a wall",
        "latest, elderly, forever, deary",
    ],
)
def test_english_is_let_through(text: str) -> None:
    assert banned(text) == []


def test_questions_are_found_in_docstrings_alone() -> None:
    source = 'def f() -> str:\n    """What it is."""\n    return "What?"\nX = 1\n"""\nHow many."""\n'
    assert sorted(line for line, _ in openings(source)) == [2, 5]
    assert openings('"""Whatever stands here, However it came."""') == []
