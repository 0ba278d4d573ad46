"""What is published of the experiments is whole: a page, data and figures, and the README's numbers."""

from __future__ import annotations

import csv
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

from parenting.experiments.calibrate.settings import SOME
from parenting.experiments.registry import experiment
from parenting.experiments.reporting.markdown import RESULTS, TRIALS, command, page
from parenting.experiments.reward_hacking.settings import VARIANTS
from parenting.experiments.safety_claims import BORN
from parenting.experiments.spec import Request
from parenting.experiments.value_iteration.settings import WORLD_SIZES
from tests.readme import PUBLISHED, README, UnknownRowError, anew, results, row, shown

NAMES = sorted(path.parent.name for path in PUBLISHED.glob(f"*/{RESULTS}"))
LIST = (PUBLISHED / "README.md").read_text(encoding="utf-8")
ARM = {
    "reward-hacking": ("queries",),
    "figure2": ("level", "inside", "queries", "stage", "steps"),
    "figure3": ("curve", "recompare"),
    "figure4": ("shift",),
    "value-iteration": ("stage", "level"),
    "calibrate": ("layout", "p_rec", "lambda_global", "lambda_local", "recompare", "entropy"),
}
"""What tells the arms of a page apart beside `of`: within one, each trial has one row."""
ALGORITHMS = {"traditional", "direct", "lax", "conservative"}
KINDS_OF_ROWS = {
    "table1": ALGORITHMS,
    "calibrate": {*ALGORITHMS, "search direct", "search traditional"},
    "figure3": {"level", "pre-parented", "parented"},
    "value-iteration": {kind.world for kind in WORLD_SIZES},
    "figure4": {"rho", "fitted"},
}
"""What stands in `of`, where the variants of the config do not say it."""


def figures(name: str) -> list[Path]:
    return sorted((PUBLISHED / name).glob("*.svg"))


def trials(name: str) -> list[dict[str, str]]:
    with (PUBLISHED / name / TRIALS).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def wanted(name: str, of: str, asked: int) -> int:
    """How many trials an arm has to have."""
    if name == "reward-hacking":
        return -(-asked // VARIANTS[of].one_of)
    if name == "calibrate" and of.startswith("search"):
        return SOME["paper"]
    return 1 if of in (BORN, "coverage") else asked


@pytest.mark.parametrize("name", NAMES)
def test_the_page_is_made_of_the_results(name: str) -> None:
    told = (PUBLISHED / f"{name}.md").read_text(encoding="utf-8")
    drawn = re.findall(rf"\]\({name}/([^)]+)\.svg\)", told)
    assert told == page(results(name), drawn)
    assert sorted(drawn) == [path.stem for path in figures(name)]
    assert all(path.with_suffix(".png").exists() for path in figures(name))


@pytest.mark.parametrize("name", NAMES)
def test_the_results_are_at_the_papers_scale_and_say_where_they_come_from(name: str) -> None:
    found, one = results(name), experiment(name)
    assert found["asked"]["scale"] == "paper"
    assert found["asked"]["trials"] == one.trials["paper"]
    assert found["command"] == command(name, Request(**found["asked"]), Path("docs/results"))
    assert re.fullmatch(r"[0-9a-f]{12}", found["commit"]), "made of files that no commit holds"
    assert found["findings"]
    assert found["title"] == one.title


@pytest.mark.parametrize("name", NAMES)
def test_every_arm_has_one_row_for_each_of_its_trials(name: str) -> None:
    arms: dict[tuple[str, ...], list[int]] = defaultdict(list)
    for one in trials(name):
        if one.get("trial"):
            arms[(one["of"], *(one[column] for column in ARM.get(name, ())))].append(int(one["trial"]))
    asked = results(name)["asked"]["trials"]
    assert arms
    for arm, numbers in arms.items():
        assert sorted(numbers) == list(range(wanted(name, arm[0], asked))), arm


@pytest.mark.parametrize("name", NAMES)
def test_no_arm_is_left_out(name: str) -> None:
    there = {one["of"] for one in trials(name)}
    config: dict[str, Any] = results(name)["config"]
    expected = {*config.get("variants", ()), *config.get("lives", {}).get("paper", ())}
    assert there >= (expected or KINDS_OF_ROWS[name])


@pytest.mark.parametrize("name", NAMES)
def test_every_column_of_the_trials_is_explained(name: str) -> None:
    first_cells = re.findall(r"^\| (`.*?) \|", LIST, re.MULTILINE)
    explained = set(re.findall(r"`([a-z_0-9]+)`", " ".join(first_cells)))
    assert set(trials(name)[0]) - explained == set()


@pytest.mark.parametrize("name", NAMES)
def test_the_list_leads_to_the_page_and_to_its_trials(name: str) -> None:
    assert f"]({name}.md)" in LIST
    assert f"]({name}/{TRIALS})" in LIST


def test_the_readmes_numbers_are_those_of_the_results() -> None:
    readme = README.read_text(encoding="utf-8")
    assert readme == anew(readme), "make them anew: python -m tests.readme"


@pytest.mark.parametrize("name", NAMES)
def test_the_readme_shows_each_page_and_does_not_hide_what_did_not_reproduce(name: str) -> None:
    told = {what for page, what in shown(README.read_text(encoding="utf-8")) if page == name}
    assert told, f"the README has no row of {name}"
    failed = {one["what"] for one in results(name)["findings"] if one["agrees"] is False}
    assert not failed or told & failed, f"the README shows none of what did not reproduce of {name}: {failed}"


def test_an_old_number_is_made_anew_and_a_lost_one_is_named() -> None:
    name, first = NAMES[0], results(NAMES[0])["findings"][0]["what"]
    start = f"| [`{name}`](docs/results/{name}.md) | {first} |"
    assert anew(f"before\n{start} lost | 1 | yes |\nafter\n") == f"before\n{row(name, first)}\nafter\n"
    assert anew(start) == row(name, first)
    with pytest.raises(UnknownRowError, match=f"Near it: .*{re.escape(first)}"):
        row(name, f"{first}!")
