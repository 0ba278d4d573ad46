"""`parenting worlds new`: a package that works at once, and is found by its entry point."""

import importlib
import subprocess
import sys
import venv
from collections.abc import Iterator
from pathlib import Path

import pytest
import torch
from typer.testing import CliRunner

import parenting as pt
from parenting.commands.main import app
from parenting.commands.worlds_new import write_skeleton
from parenting.envs import registry
from parenting.envs.installed import BrokenPackageError, Installed
from parenting.server.doctor.machine import packages
from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import NewRun, plan
from tests.lengths import TORTURE
from tests.tree import ROOT

NAME, MODULE = "salt-mine", "salt_mine"


def put_on_the_path(folder: Path, entry_points: str) -> None:
    """Do what `pip install` does, without pip: the module lies on the path, its metadata beside it."""
    metadata = folder / f"{MODULE}-0.1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {NAME}\nVersion: 0.1.0\n")
    (metadata / "entry_points.txt").write_text(f"[parenting.worlds]\n{entry_points}\n")


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder on the path, and a registry that has not looked for packages yet."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registry, "INSTALLED", Installed("parenting.worlds", "world", registry._usable))
    yield tmp_path
    for name in [name for name in sys.modules if name.partition(".")[0] in (MODULE, f"test_{MODULE}")]:
        del sys.modules[name]


def test_the_skeletons_own_tests_pass_once_it_is_installed(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = CliRunner().invoke(app, ["worlds", "new", NAME, "--out", str(path)])
    assert result.exit_code == 0, result.output
    assert 'salt-mine = "salt_mine.spec:SPEC"' in (path / "pyproject.toml").read_text()
    put_on_the_path(path, f"{NAME} = {MODULE}.spec:SPEC")
    monkeypatch.setattr(registry, "INSTALLED", Installed("parenting.worlds", "world", registry._usable))
    monkeypatch.syspath_prepend(path / "tests")
    tests = importlib.import_module(f"test_{MODULE}")
    ran = [getattr(tests, name)() for name in dir(tests) if name.startswith("test_")]
    assert len(ran) == 5
    assert plan(NewRun(world=NAME))["level"] == "cave"  # as the web process plans a run
    assert [found.state for found in packages()] == ["ok"]


@pytest.mark.parametrize(
    ("point", "said"),
    [
        ("no_such_module_anywhere:SPEC", "ModuleNotFoundError: No module named 'no_such_module_anywhere'"),
        ("json:NOTHING", "AttributeError: module 'json' has no attribute 'NOTHING'"),
        ("json:dumps", "a WorldSpec is wanted"),
        ("parenting.envs.levels.side_effects:SPEC", "but the world is called 'side-effects'"),
        ("ends_it_all:SPEC", "SystemExit: 3"),
    ],
)
def test_a_broken_package_is_named_in_a_sentence_and_ends_nothing(path: Path, point: str, said: str) -> None:
    (path / "ends_it_all.py").write_text("raise SystemExit(3)\n")
    put_on_the_path(path, f"{NAME} = {point}")
    listed = CliRunner().invoke(app, ["worlds", "--json"])
    assert listed.exit_code == 0, listed.output
    assert f"The world '{NAME}' of the package {NAME} 0.1.0 cannot be used" in listed.stderr
    assert said in listed.stderr
    assert NAME not in registry.WORLDS
    assert "side-effects" in registry.WORLDS
    with pytest.raises(BrokenPackageError, match="cannot be used"):
        pt.make(NAME)
    with pytest.raises(InvalidFieldsError, match="cannot be used"):
        plan(NewRun(world=NAME))
    assert [(found.state, said in found.said) for found in packages()] == [("warning", True)]
    refused = CliRunner().invoke(app, ["run", NAME])
    assert (refused.exit_code, refused.stdout) == (2, "")


def test_an_entry_point_may_lead_to_a_table(path: Path) -> None:
    """A module of two lines is a world for commands, pages and workers."""
    table = "{s: {a: [(1.0, 1, 1.0, True)] for a in range(4)} for s in range(2)}"
    (path / f"{MODULE}.py").write_text(
        f"import parenting as pt\nmine = pt.TableWorld({table}, (1, 2), goal={{1}}, name='{NAME}')\n"
    )
    put_on_the_path(path, f"{NAME} = {MODULE}:mine")
    assert pt.worlds()[NAME] == ("start",)
    planned = plan(NewRun(world=NAME))
    assert (planned["level"], "\ntable: " in planned["level_text"]) == ("start", True)
    assert pt.make(NAME).likelihood(pt.make(NAME).beginnings(), torch.tensor([0])).tolist() == [1.0]


def test_a_package_that_is_just_being_imported_is_not_taken_for_a_broken_one(path: Path) -> None:
    """As where a module of worlds is imported by hand, and looks at the registry before it has its own."""
    write_skeleton(NAME, path)
    early = f"from parenting.envs import registry\nassert '{NAME}' not in list(registry.WORLDS)\n"
    file = path / MODULE / "spec.py"
    file.write_text(early + file.read_text())
    put_on_the_path(path, f"{NAME} = {MODULE}.spec:SPEC")
    importlib.import_module(f"{MODULE}.spec")
    assert NAME in registry.WORLDS


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Lava", "lower-case words"),
        ("a_b", "lower-case words"),
        ("lambda", "lower-case words"),
        ("side-effects", "already"),
    ],
)
def test_a_name_that_no_world_may_have_is_refused(tmp_path: Path, name: str, said: str) -> None:
    result = CliRunner().invoke(app, ["worlds", "new", name, "--out", str(tmp_path / "new")])
    assert (result.exit_code, said in result.stderr) == (2, True)
    assert not (tmp_path / "new").exists()


def test_nothing_is_written_over(tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text("mine")
    result = CliRunner().invoke(app, ["worlds", "new", NAME, "--out", str(tmp_path)])
    assert (result.exit_code, "there already" in result.stderr) == (2, True)
    assert [file.name for file in tmp_path.iterdir()] == ["pyproject.toml"]


@pytest.mark.torture
@pytest.mark.skipif(not TORTURE, reason="it makes a virtual environment and runs pip; make torture does")
def test_after_pip_install_its_tests_pass_and_parenting_lists_it(tmp_path: Path) -> None:
    """As its README says, with setuptools and pytest of this environment, and without a network."""
    write_skeleton(NAME, tmp_path / NAME)
    venv.create(tmp_path / "venv", with_pip=False)
    python = tmp_path / "venv/bin/python"
    (site,) = (tmp_path / "venv/lib").glob("python*/site-packages")
    (site / "ours.pth").write_text(
        "\n".join([str(ROOT), *(one for one in sys.path if "site-packages" in one)])
    )
    install = [sys.executable, "-m", "pip", "--python", str(python), "install", "--no-index", "--no-deps"]
    for command in (
        [*install, "--no-build-isolation", "-e", "."],
        [str(python), "-m", "pytest", "-q"],
        [str(python), "-m", "parenting.commands.main", "run", NAME, "--trials", "2"],
    ):
        done = subprocess.run(command, cwd=tmp_path / NAME, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
    assert f"{NAME}, cave: 2 trials until optimal" in done.stdout
