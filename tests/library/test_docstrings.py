"""The docstrings of the public names: each has an example, and every example runs."""

from __future__ import annotations

import doctest
from pathlib import Path
from typing import Any

import pytest

import parenting as pt

RECORDS = {"Evaluation", "FormatError", "Progress", "ReplayError", "Tick", "Drawing", "Question"}
"""Names that others return or raise: their examples stand there."""
FUNCTIONS_AND_CLASSES = [name for name in pt.__all__ if name not in ("PRESETS", "testing")]

LONG = {"TrainResult", "TableWorld", "train"}
"""Their examples train agents."""


def examples(name: str) -> list[doctest.DocTest]:
    """The examples of a public name and of its methods."""
    found = doctest.DocTestFinder().find(getattr(pt, name), name, globs={})
    return [one for one in found if one.examples]


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in FUNCTIONS_AND_CLASSES]
)
def test_every_example_runs_and_shows_what_it_gives(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    said: list[str] = []
    for one in examples(name):
        runner.run(one, out=said.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(said)


@pytest.mark.parametrize("name", FUNCTIONS_AND_CLASSES)
def test_every_name_of_the_library_has_an_example(name: str) -> None:
    value: Any = getattr(pt, name)
    if value.__module__.startswith("parenting.library") and name not in RECORDS:
        assert examples(name), name


@pytest.mark.parametrize("name", [name for name in FUNCTIONS_AND_CLASSES if name[0].islower()])
def test_functions_say_what_they_take_and_what_they_give(name: str) -> None:
    doc = getattr(pt, name).__doc__
    assert doc.splitlines()[0].endswith(".")
    if getattr(pt, name).__code__.co_argcount:
        assert "Args:" in doc, name
    if name != "register":  # it gives nothing
        assert "Returns:" in doc, name


def test_the_check_of_worlds_shows_an_example_that_runs() -> None:
    (example,) = doctest.DocTestFinder().find(pt.testing.check_world, "check_world", globs={})
    assert example.examples
    assert doctest.DocTestRunner().run(example).failed == 0
