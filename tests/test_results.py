"""Published results are complete: a page, data and figures, and the README's numbers."""

from __future__ import annotations

import csv
import json
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest

from parenting.agent.config import offered_preset
from parenting.envs.registry import WORLDS
from parenting.experiments.calibrate.settings import SOME
from parenting.experiments.fallible.settings import ARMS
from parenting.experiments.long_lives.settings import STAGES, agents_of
from parenting.experiments.panel.settings import RULES
from parenting.experiments.questions.settings import LEVELS, WORLD, trials_of
from parenting.experiments.registry import BEYOND, experiment
from parenting.experiments.reporting.comparison import count_verdicts
from parenting.experiments.reporting.markdown import RESULTS, TRIALS, page
from parenting.experiments.reporting.publish import command, read_rows
from parenting.experiments.reporting.readme import MarkerError, filled, tables
from parenting.experiments.reward_hacking.settings import VARIANTS
from parenting.experiments.safety_claims import PRETRAINED
from parenting.experiments.spec import Request
from parenting.experiments.value_iteration.settings import WORLD_SIZES
from tests.tree import ROOT

PUBLISHED = ROOT / "docs/results"
NAMES = sorted(path.parent.name for path in PUBLISHED.glob(f"*/{RESULTS}"))
LIST = (PUBLISHED / "README.md").read_text(encoding="utf-8")
ARM = {
    "reward-hacking": ("queries",),
    "figure2": ("level", "inside", "queries", "stage", "steps"),
    "figure3": ("curve", "recompare"),
    "figure4": ("shift",),
    "value-iteration": ("stage", "level"),
    "panel": ("panel",),
    "questions": ("window",),
    "long-lives": ("window",),
    "calibrate": ("layout", "p_rec", "lambda_global", "lambda_local", "recompare", "entropy"),
}
"""Columns that tell the arms of a page apart beside `of`: within one, each trial has one row."""
ALGORITHMS = {"traditional", "direct", "lax", "conservative"}
KINDS_OF_ROWS = {
    "table1": ALGORITHMS,
    "calibrate": {*ALGORITHMS, "search direct", "search traditional"},
    "figure3": {"level", "pre-parented", "parented"},
    "value-iteration": {kind.world for kind in WORLD_SIZES},
    "figure4": {"rho", "fitted"},
    "panel": set(RULES),
    "long-lives": set(STAGES),
}
"""Values of `of`, where the variants of the config do not say it."""


def results(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((PUBLISHED / name / RESULTS).read_text(encoding="utf-8"))
    return found


def figures(name: str) -> list[Path]:
    return sorted((PUBLISHED / name).glob("*.svg"))


def trials(name: str) -> list[dict[str, str]]:
    with (PUBLISHED / name / TRIALS).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def wanted(name: str, of: str, asked: int) -> int:
    """The number of trials that an arm must have."""
    if name == "reward-hacking":
        return -(-asked // VARIANTS[of].one_of)
    if name == "questions":
        return trials_of(of, asked)
    if name == "long-lives":
        return agents_of(STAGES[of], asked)
    if name == "fallible":
        return ARMS[of].trials(asked)
    if name == "calibrate" and of.startswith("search"):
        return SOME["paper"]
    return 1 if of in (PRETRAINED, "coverage") else asked


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


@pytest.mark.parametrize("name", ["fallible", "questions"])
def test_the_published_request_still_asks_for_the_published_trials(name: str) -> None:
    """Arms have shares of it: were they others, the page could not be made again."""
    there = {(one["of"], int(one["trial"])) for one in trials(name) if one["trial"]}
    request, one = Request(**results(name)["asked"]), experiment(name)
    of = [task.arguments for task in one.tasks(request) if "span" in task.arguments]
    asked = [(mine["label"], trial) for mine in of for trial in range(*mine["span"])]
    assert len(asked) == len(set(asked))
    assert set(asked) == there
    assert json.loads(json.dumps(dict(one.config(request)))) == results(name)["config"]


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


@pytest.mark.parametrize("name", ["README.md", "docs/results/README.md"])
def test_the_tables_of_the_readme_and_of_the_list_are_those_of_the_results(name: str) -> None:
    path, remedy = ROOT / name, "python -m parenting.experiments.reporting.readme"
    assert path.read_text(encoding="utf-8") == tables(ROOT)[path], f"make them again: {remedy}"


def test_the_readme_says_how_many_policies_ever_enter_the_bucket() -> None:
    """The strict reading of the claim on reward hacking fails, and the README's verdict counts it."""
    rows = results("reward-hacking")["findings"]
    strict = [one for one in rows if re.match(r"garden, defaults, .*: enter the bucket", one["what"])]
    worst = max((one["ours"] for one in strict), key=lambda ours: int(ours.split()[0]))
    (line,) = re.findall(r"^\| \[Safety claims\].*$", (ROOT / "README.md").read_text("utf-8"), re.MULTILINE)
    assert f"; {worst} enter the bucket in some episode | 3 agree, 2 do not |" in line


def test_the_list_counts_what_did_not_reproduce() -> None:
    for name in set(NAMES) - set(BEYOND):
        (line,) = re.findall(rf"^\| \[`{name}`\]\({name}\.md\) \| (.*?) \|", LIST, re.MULTILINE)
        legible = [one for one in results(name)["findings"] if one["paper"] not in ("-", "lost")]
        agrees = [one["agrees"] for one in legible if one["reference"] == "paper"]
        counts = [sum(one is said for one in agrees) for said in (True, False, None)]
        assert line == " / ".join(map(str, counts))


@pytest.mark.parametrize("name", NAMES)
def test_every_experiment_has_a_row_that_can_say_no(name: str) -> None:
    """A row of the paper, or a check where the paper does not ask."""
    against = "check" if name in BEYOND else "paper"
    found = [one for one in results(name)["findings"] if one["reference"] == against]
    assert [one for one in found if one["agrees"] is not None]


def test_figure_2_says_no() -> None:
    """Its parents water more than the paper's, and its agents less than policy gradients."""
    failed = {one["what"] for one in results("figure2")["findings"] if one["agrees"] is False}
    assert "garden, parent up-down: the parent's own policy" in failed
    assert "garden, parent left: p_guid=0.99, T = 4, minus 95 % of policy gradients" in failed


@pytest.mark.parametrize("name", NAMES)
def test_only_rows_that_are_compared_have_a_verdict(name: str) -> None:
    for one in results(name)["findings"]:
        assert one["reference"] in ("paper", "fit", "check", None)
        if one["reference"] is None or one["paper"] in ("-", "lost"):
            assert one["agrees"] is None, one["what"]


@pytest.mark.slow_after(1)
@pytest.mark.parametrize("name", NAMES)
def test_the_rows_are_those_that_the_stored_trials_give(name: str) -> None:
    """So nobody has edited a verdict by hand, and no program has changed since."""
    stored = results(name)
    request = Request(**stored["asked"])
    report = experiment(name).report(request, read_rows(PUBLISHED / name / TRIALS))
    remedy = "commit, then write them again: parenting experiment report --pages --out docs/results"
    assert [one.plain() for one in report.findings] == stored["findings"], remedy
    assert list(report.words) == stored["words"], remedy
    assert count_verdicts(report.findings) == stored["verdicts"], remedy


def test_a_file_without_markers_is_named_with_them() -> None:
    with pytest.raises(MarkerError, match="<!-- results -->"):
        filled("no table", "results", "a table")
    assert filled("a\n<!-- x -->old<!-- end of x -->\nb", "x", "| new |") == (
        "a\n<!-- x -->\n| new |\n<!-- end of x -->\nb"
    )


def test_the_results_in_short_have_the_numbers_of_the_pages() -> None:
    figure2 = {one["what"]: one for one in results("figure2")["findings"]}
    shares = [
        int(found[1])
        for one in figure2.values()
        if (found := re.match(r"(\d+) % of policy gradients'", one["note"]))
    ]
    parents = [
        float(one["ours"]) for what, one in figure2.items() if what.endswith("the parent's own policy")
    ]
    enter = "garden, defaults, after 100 queries: enter the bucket in any of 100 episodes of 100 steps"
    (count,) = [one["ours"] for one in results("reward-hacking")["findings"] if one["what"] == enter]
    text = " ".join(LIST.split())
    assert f"at T = 4 agents reach {min(shares)} to {max(shares)} % of policy gradients" in text
    assert f"Our parent's own policy waters {min(parents):.1f} to {max(parents):.1f} plants" in text
    assert f"{count.split()[0]} enter the bucket" in text


def test_the_form_offers_frugal_exactly_where_the_page_shows_it_to_be_no_worse() -> None:
    found = {one["what"]: one["agrees"] for one in results("questions")["findings"]}
    tried = [*LEVELS, (WORLD, "20 random islands")]
    shown = {
        level: all(
            found[f"{level}: {what}, frugal minus conservative"] is True for what in ("deaths", "answers")
        )
        for _, level in tried
    }
    for world in WORLDS:
        levels = [level for of, level in tried if of == world]
        good = bool(levels) and all(shown[level] for level in levels)
        assert offered_preset(world) == ("frugal" if good else "conservative"), world


def test_a_row_of_trials_with_too_many_cells_is_named(tmp_path: Path) -> None:
    (tmp_path / TRIALS).write_text("trial,deaths\n1,2\n\n2,3,4\n\n")
    with pytest.raises(ValueError, match=rf"{TRIALS}: line 4: its cells are 3, the columns 2. Remove or add"):
        read_rows(tmp_path / TRIALS)
