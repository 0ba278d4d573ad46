"""`parenting experiment`: what is wrong is said in a sentence, and nothing is written then."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from parenting.commands.main import app
from parenting.commands.options import among, folder, whole

MAKE = ("figure4", "--trials", "1", "--workers", "1")


def call(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["experiment", *arguments], env={"COLUMNS": "200"})


def wrong(*arguments: str) -> str:
    """Its message on one line."""
    said = call(*arguments)
    assert said.exit_code == 2, said.output
    assert "Traceback" not in said.output
    return " ".join(said.output.replace("│", " ").split())


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of Figure 4, with their pieces."""
    out = tmp_path_factory.mktemp("results")
    assert call(*MAKE, "--out", str(out)).exit_code == 0
    return out


@pytest.mark.parametrize(
    ("option", "value", "remedy"),
    [
        ("--trials", "abc", "from 1 to 100000"),
        ("--trials", "0", "from 1 to 100000"),
        ("--trials", "1.5", "from 1 to 100000"),
        ("--trials", "99999999999999999999", "from 1 to 100000"),
        ("--seed", "-1", "from 0 to 9007199254740991"),
        ("--workers", "0", "from 1 to 1000"),
        ("--scale", "huge", "quick, paper"),
        ("--device", "tpu", "cpu, cuda"),
        ("--out", "", "for the current folder"),
    ],
)
def test_a_wrong_value_is_said_with_what_would_do(
    option: str, value: str, remedy: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said = wrong("figure4", option, value)
    assert f"'{option}'" in said
    assert f"'{value}'" in said
    assert remedy in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["figure4", "report"])
def test_a_file_is_no_folder_for_results(name: str, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    for out in (file, file / "below"):
        said = wrong(name, "--out", str(out))
        assert f"'{out}' is not a folder: {file} is a file. Name another one." in said
        assert "--cluster" not in said


def test_an_unknown_name_is_said_with_those_that_there_are() -> None:
    said = wrong("figure5")
    assert "'figure5'" in said
    assert "figure4" in said
    assert "report" in said


@pytest.mark.parametrize(
    "options", [("--trials", "3"), ("--device", "cpu", "--seed", "0"), ("--cluster", "tcp://127.0.0.1:9")]
)
def test_a_report_refuses_what_it_would_not_heed(options: tuple[str, ...], done: Path) -> None:
    said = wrong("report", *options, "--out", str(done))
    assert f"remove {', '.join(options[::2])}." in said
    assert not (done / "report.html").exists()


def test_a_folder_that_cannot_be_written_is_named(done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_arguments: Any, **_named: Any) -> None:
        raise OSError(28, "No space left on device", "here/results.json")

    monkeypatch.setattr("parenting.experiments.reporting.publish.publish", full)
    said = wrong(*MAKE, "--out", str(done))
    assert f"--out {done}: No space left on device: here/results.json. Make room there" in said


@pytest.mark.slow_after(2)
@pytest.mark.parametrize("name", ["plan.json", "spent.json", "fit-000000.json"])
@pytest.mark.parametrize("text", ["", '{"half', "[]", "3", "\udcff"])
def test_a_damaged_piece_is_named_and_can_be_removed(
    name: str, text: str, done: Path, tmp_path: Path
) -> None:
    out = copytree(done, tmp_path / "results")
    file = out / "figure4/pieces" / name
    file.write_bytes(text.encode(errors="surrogateescape"))
    said = wrong(*MAKE, "--out", str(out))
    assert f"{file} is damaged, or of an older version. Remove it" in said
    file.unlink()
    assert call(*MAKE, "--out", str(out)).exit_code == 0
    assert (out / "figure4/trials.csv").read_bytes() == (done / "figure4/trials.csv").read_bytes()


def test_the_page_says_how_to_make_it_again_where_it_is(done: Path) -> None:
    page = (done / "figure4.md").read_text()
    assert f"--trials 1 --seed 0 --device cpu --out {done}\n" in page
    assert "\n1 trial, seed 0" in page


def test_options_read_what_is_right(tmp_path: Path) -> None:
    assert whole(1, 3)("3") == 3
    assert among(("a", "b"))("b") == "b"
    assert folder(str(tmp_path / "new/one")) == tmp_path / "new/one"
    assert folder(".") == Path(".")
