"""What is published of the experiments is whole: a page, data and figures, and the README's numbers."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import pytest

from experiments.catalogue import experiment
from experiments.experiment import Asked
from experiments.publish import RESULTS, TRIALS, command, page
from tests.tree import ROOT

PUBLISHED = ROOT / "docs/results"
NAMES = sorted(path.parent.name for path in PUBLISHED.glob(f"*/{RESULTS}"))
LINE = re.compile(r"\| \[`([a-z0-9-]+)`\]\(docs/results/\1\.md\) \| (.+?) \| (.+?) \| (.+?) \|")


def results(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((PUBLISHED / name / RESULTS).read_text(encoding="utf-8"))
    return found


def figures(name: str) -> list[Path]:
    return sorted((PUBLISHED / name).glob("*.svg"))


@pytest.mark.parametrize("name", NAMES)
def test_the_page_is_made_of_the_results(name: str) -> None:
    told = (PUBLISHED / f"{name}.md").read_text(encoding="utf-8")
    drawn = re.findall(rf"\]\({name}/([^)]+)\.svg\)", told)
    assert told == page(results(name), drawn)
    assert sorted(drawn) == [path.stem for path in figures(name)]
    assert all(path.with_suffix(".png").exists() for path in figures(name))


@pytest.mark.parametrize("name", NAMES)
def test_the_results_are_at_the_papers_scale_and_say_where_they_come_from(name: str) -> None:
    found = results(name)
    assert found["asked"]["scale"] == "paper"
    assert found["command"] == command(name, Asked(**found["asked"]))
    assert re.fullmatch(r"[0-9a-f]{12}", found["commit"]), "made of files that no commit holds"
    assert found["findings"]
    assert found["title"] == experiment(name).title


@pytest.mark.parametrize("name", NAMES)
def test_there_is_a_row_for_every_trial(name: str) -> None:
    with (PUBLISHED / name / TRIALS).open(encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) >= results(name)["asked"]["trials"]


@pytest.mark.parametrize("name", NAMES)
def test_the_readmes_numbers_are_those_of_the_results(name: str) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    told = [line for line in LINE.findall(readme) if line[0] == name]
    found = {(one["what"], one["paper"], one["ours"]) for one in results(name)["findings"]}
    assert told, f"the README has no line of {name}"
    assert [line for line in told if line[1:] not in found] == []


@pytest.mark.parametrize("name", NAMES)
def test_the_list_has_its_line(name: str) -> None:
    assert f"]({name}.md)" in (PUBLISHED / "README.md").read_text(encoding="utf-8")
