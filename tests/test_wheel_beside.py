"""The wheel beside a project that has `envs/`, `agent/`, `server/` and `web/`: both work, nothing mixes."""

from __future__ import annotations

import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

from tests.test_wheel import wheel_of_the_tree

FOLDERS = ("agent", "envs", "server", "web", "library", "commands", "experiments", "parents")


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh environment with the wheel in it; the other libraries are those of the present one."""
    place = tmp_path_factory.mktemp("environment")
    venv.create(place, with_pip=False)
    purelib = next(place.glob("lib/python*/site-packages"))
    # Our own installation, which is editable, must not be found: its .pth files are not read from here.
    (purelib / "present.pth").write_text(f"{sysconfig.get_path('purelib')}\n")
    command = [sys.executable, "-m", "pip", "--python", str(place / "bin/python"), "install", "--quiet"]
    options = ["--no-deps", "--no-index", "--ignore-installed", "--disable-pip-version-check"]
    options += ["--no-compile"]  # Python compiles what it imports
    subprocess.run([*command, *options, str(wheel_of_the_tree())], check=True)
    return place / "bin/python"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A researcher's folder with packages of the same names as our folders."""
    for name in FOLDERS:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(f"OWNER = 'the researcher, {name}'\n")
    (tmp_path / "envs/gym.py").write_text("OWNER = 'the researcher'\n")
    return tmp_path


def run(command: list[str], project: Path) -> str:
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(project)}
    result = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.mark.slow
def test_twenty_agents_are_trained_beside_folders_of_the_same_names(python: Path, project: Path) -> None:
    code = (
        "import parenting as pt; "
        "r = pt.train('unsafe-exploration', preset='conservative', trials=20); print(r.mean()); "
        f"import sys; assert not {{*{FOLDERS}}} & {{*sys.modules}}; "
        "assert pt.__file__.startswith(sys.prefix), pt.__file__"
    )
    said = run([str(python), "-c", code], project)
    assert "'finished': 1.0" in said


@pytest.mark.slow
def test_the_projects_own_packages_stay_its_own(python: Path, project: Path) -> None:
    code = (
        "import sys, envs, envs.gym, agent, server, web; print(envs.OWNER, envs.gym.OWNER, agent.OWNER); "
        "import parenting.envs.gym, parenting.server.app; "
        "assert parenting.envs.gym.__file__.startswith(sys.prefix); print(envs.gym.OWNER)"
    )
    assert run([str(python), "-c", code], project) == (
        "the researcher, envs the researcher the researcher, agent\nthe researcher\n"
    )


@pytest.mark.slow
def test_the_command_works_there(python: Path, project: Path) -> None:
    said = run([str(python.parent / "parenting"), "--help"], project)
    assert "parenting up" in said
    assert "island" in run([str(python.parent / "parenting"), "worlds"], project)
