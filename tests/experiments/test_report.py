"""The page of all experiments: every finding stands on it, figures too, and it loads nothing."""

from __future__ import annotations

import json
import re
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest
from typer.testing import CliRunner

from parenting.commands.main import app
from parenting.experiments.registry import NAMES
from parenting.experiments.reporting.comparison import (
    LOST,
    NO,
    NOTHING,
    OPEN,
    SILENT,
    YES,
    Comparison,
    verdict,
)
from parenting.experiments.reporting.html import NoResultsError, prose, report
from parenting.experiments.spec import Request

run = CliRunner().invoke
OLD = Path(__file__).parents[1] / "old/0.1.0/results"
MAKE = ["experiment", "figure4", "--trials", "1", "--workers", "1", "--out"]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of Figure 4, made of one real fit."""
    folder = tmp_path_factory.mktemp("made")
    said = run(app, [*MAKE, str(folder)])
    assert said.exit_code == 0, said.output
    return folder


@pytest.fixture
def out(made: Path, tmp_path: Path) -> Path:
    """A copy of them."""
    return copytree(made, tmp_path / "results")


def told_of(line: str) -> list[str]:
    """The text of the cells of a row of the summary, without its first."""
    cells = re.findall(r"<td[^>]*>(.*?)</td>", line, re.DOTALL)
    return [" ".join(re.sub("<[^>]+>", "", cell).split()) for cell in cells]


def changed(out: Path, **others: Any) -> str:
    """The page once something else stands in results.json."""
    path = out / "figure4/results.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | others))
    return report(out).read_text()


def test_everything_found_stands_on_the_page(out: Path) -> None:
    said = run(app, ["experiment", "report", "--out", str(out)])
    assert said.exit_code == 0, said.output
    page = (out / "report.html").read_text()
    assert "planner on the fitted reward, shifted by -1" in page
    assert "1 of 1 unsafe" in page
    assert "parenting experiment figure4 --scale paper --trials 1" in page
    assert "1 trial, seed 0" in page
    assert page.count("<img") == 1


def test_it_loads_nothing_and_runs_nothing(out: Path) -> None:
    page = report(out).read_text()
    assert "<script" not in page
    sources = re.findall(r'src="([^"]*)"', page)
    assert all(source.startswith("data:image/svg+xml;base64,") for source in sources)
    links = re.findall(r'href="(?!#)([^"]*)"', page)
    assert sorted(links) == ["figure4/results.json", "figure4/trials.csv"]
    assert all((out / link).is_file() for link in links)


def test_what_others_wrote_is_escaped(out: Path) -> None:
    evil = "<b onclick=x>&\"'`<u>`*<u>*"
    found = Comparison(evil, evil, evil, evil, evil, None, evil).plain()
    page = changed(out, title=evil, claim=evil, words=[evil], command=evil, commit=evil, findings=[found])
    assert "<b onclick" not in page
    assert "<u>" not in page


def test_the_summary_counts_rows_by_what_they_are_compared_with_and_leads_to_them(out: Path) -> None:
    rows = [
        *[Comparison("a", "1", "1", agrees=True).plain()] * 5,
        *[Comparison("b", "never", "3", agrees=False).plain()] * 3,
        *[Comparison("c", "51", "40").plain()] * 2,
        *[Comparison("d", paper, "2").plain() for paper in (SILENT, LOST, LOST, LOST)],
        *[Comparison("e", "47", "47", agrees=True, reference="fit").plain()] * 6,
        *[Comparison("f", "4.5", "4.6", agrees=True, reference="check").plain()] * 7,
        Comparison("g", SILENT, "2", reference=None).plain(),
    ]
    page = changed(out, findings=rows)
    (line,) = re.findall(r'<tr[^>]*><th[^>]*><a href="#figure4">.*?</tr>', page, re.DOTALL)
    assert told_of(line) == ["5 yes 3 no 2 no verdict", "6 yes", "7 yes"]
    assert '<section id="figure4"' in page


def test_rows_of_version_0_1_are_counted_by_what_they_were_compared_with(out: Path) -> None:
    rows: list[dict[str, Any]] = [
        {"what": "a", "paper": "47 +- 14", "agrees": True, "note": "fitted: the search aims at it"},
        {"what": "b", "paper": "4.49 (our first table)", "agrees": True},
        {"what": "c", "paper": "within 5 % of 4.47 (look-ahead)", "agrees": True},
        {"what": "d", "paper": "never", "agrees": False},
        {"what": "e", "paper": SILENT, "agrees": None},
    ]
    told = {"ours": "1", "difference": "", "interval": "", "note": ""}
    page = changed(out, findings=[told | row for row in rows])
    (line,) = re.findall(r'<tr[^>]*><th[^>]*><a href="#figure4">.*?</tr>', page, re.DOTALL)
    assert told_of(line) == ["1 no", "1 yes", "2 yes"]


@pytest.mark.slow
def test_the_pages_are_written_again_from_the_stored_trials(out: Path) -> None:
    """Verdicts come from the trials, not from what was stored of them; trials and their origin stay."""
    kept = ("command", "commits", "versions", "seconds", "workers", "asked", "config")
    before = json.loads((out / "figure4/results.json").read_text())
    trials = (out / "figure4/trials.csv").read_bytes()
    changed(out, findings=[], words=["edited"])
    (out / "figure4.md").unlink()
    (out / "figure4/shift.svg").unlink()
    said = run(app, ["experiment", "report", "--pages", "--out", str(out)])
    assert said.exit_code == 0, said.output
    after = json.loads((out / "figure4/results.json").read_text())
    assert {key: after[key] for key in (*kept, "findings", "words")} == {
        key: before[key] for key in (*kept, "findings", "words")
    }
    assert (out / "figure4/trials.csv").read_bytes() == trials
    assert (out / "figure4.md").exists()
    assert (out / "figure4/shift.svg").exists()


@pytest.mark.slow
def test_pages_of_version_0_1_are_written_again(tmp_path: Path) -> None:
    """Their rows then say what they are compared with, and their trials stay."""
    results = copytree(OLD, tmp_path / "results")
    said = run(app, ["experiment", "report", "--pages", "--out", str(results)])
    assert said.exit_code == 0, said.output
    for path in OLD.glob("*/results.json"):
        name = path.parent.name
        stored = json.loads((results / name / "results.json").read_text())
        assert {one["reference"] for one in stored["findings"]} >= {"paper"}
        assert (results / name / "trials.csv").read_bytes() == (OLD / name / "trials.csv").read_bytes()
        assert "## Compared with the paper" in (results / f"{name}.md").read_text()


def test_pages_are_an_option_of_the_report_alone() -> None:
    said = run(app, ["experiment", "figure4", "--pages"])
    assert said.exit_code == 2
    assert "parenting experiment report --pages" in said.output


@pytest.mark.parametrize(
    ("paper", "agrees", "said"),
    [
        ("yes", True, YES),
        ("lost", False, NO),
        ("yes", None, OPEN),
        ("51 +- (lost)", None, OPEN),
        (SILENT, None, NOTHING),
        (LOST, None, NOTHING),
    ],
)
def test_no_verdict_on_a_claim_is_not_the_papers_silence(paper: str, agrees: bool | None, said: str) -> None:
    assert verdict(Comparison("it", paper, "ours", agrees=agrees)) == said


def test_what_is_not_done_is_said_with_its_command(out: Path) -> None:
    page = report(out).read_text()
    missing = [name for name in NAMES if f"parenting experiment {name} --out {out}" in page]
    assert missing == [name for name in NAMES if name != "figure4"]
    assert page.count("not done here") == len(missing)


def test_a_few_trials_are_not_taken_for_the_papers_number(out: Path) -> None:
    assert "quick scale" not in report(out).read_text()
    assert "quick scale: 3 trials" in changed(out, asked=Request(3, scale="quick")._asdict())


def test_words_keep_their_marks() -> None:
    assert prose("`a < b` and *so on*, 2 * 3 * 4") == "<code>a &lt; b</code> and <i>so on</i>, 2 * 3 * 4"


@pytest.mark.slow
def test_the_same_numbers_draw_the_same_file(out: Path) -> None:
    drawn = out / "figure4/shift.svg"
    before = drawn.read_bytes()
    drawn.unlink()
    assert run(app, [*MAKE, str(out)]).exit_code == 0
    assert drawn.read_bytes() == before


def test_no_results_are_said(tmp_path: Path) -> None:
    with pytest.raises(NoResultsError, match="parenting experiment all --scale quick"):
        report(tmp_path)
    assert run(app, ["experiment", "report", "--out", str(tmp_path)]).exit_code == 2


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"name": "figure4"}', "\x00"])
def test_broken_results_are_named_with_the_remedy(out: Path, text: str) -> None:
    path = out / "figure4/results.json"
    path.write_text(text)
    said = run(app, ["experiment", "report", "--out", str(out)])
    assert said.exit_code == 2, said.output
    assert str(path) in said.output
    assert f"parenting experiment figure4 --out {out}" in said.output
    assert not (out / "report.html").exists()
