"""The page of all experiments: every finding stands on it, figures too, and it loads nothing."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from commands.main import app
from experiments.catalogue import experiment
from experiments.experiment import Asked
from experiments.labour import do
from experiments.publish import publish
from experiments.report import NoResults, report

run = CliRunner().invoke
ASKED = Asked(1)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """The results of Figure 4, made of one real fit."""
    one = experiment("figure4")
    (task,) = one.tasks(ASKED)
    publish(one, ASKED, do(task), tmp_path, 1.0, 1)
    return tmp_path


def test_everything_found_stands_on_the_page(out: Path) -> None:
    said = run(app, ["experiment", "report", "--out", str(out)])
    assert said.exit_code == 0, said.output
    page = (out / "report.html").read_text()
    assert "planner on the fitted reward, shifted by -1" in page
    assert "1 of 1 do harm" in page
    assert "parenting experiment figure4 --scale paper --trials 1" in page
    assert page.count("<svg") == 1
    assert not re.findall(r'(?:src|href)="(?!#)', page)


def test_figures_share_no_ids(out: Path) -> None:
    drawn = out / "figure4/shift.svg"
    drawn.with_name("again.svg").write_text(drawn.read_text())
    page = report(out).read_text()
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    wanted = set(re.findall(r'href="#([^"]+)"', page)) | set(re.findall(r"url\(#([^)]+)\)", page))
    assert wanted <= set(ids)


def test_the_same_numbers_draw_the_same_file(out: Path) -> None:
    before = (out / "figure4/shift.svg").read_bytes()
    one = experiment("figure4")
    publish(one, ASKED, do(one.tasks(ASKED)[0]), out, 1.0, 1)
    assert (out / "figure4/shift.svg").read_bytes() == before


def test_no_results_are_said(tmp_path: Path) -> None:
    with pytest.raises(NoResults, match="parenting experiment all --scale quick"):
        report(tmp_path)
    assert run(app, ["experiment", "report", "--out", str(tmp_path)]).exit_code == 2
