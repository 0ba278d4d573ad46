"""`parenting up` starts our web and our worker, whatever lies in the folder that it is called in."""

from __future__ import annotations

import re
import time
from pathlib import Path

import httpx2
import pytest

from tests.server.serving import parenting, until_up

NAMES = ("parenting", "agent", "commands", "envs", "server", "web")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder of somebody else's, whose packages have our names and cannot be imported."""
    for name in NAMES:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(f"raise SystemExit('{name} of the other project')\n")
    return tmp_path


@pytest.mark.slow
def test_packages_of_the_same_names_in_the_folder_are_not_ours(project: Path) -> None:
    with parenting("up", "--port", "0", "--no-browser", data=project) as up:
        assert up.stdout is not None
        url = re.findall(r"http://localhost:\d+", up.stdout.readline())[0]
        until_up(url)
        end = time.monotonic() + 60
        while (
            reply := httpx2.get(f"{url}/readyz")
        ).status_code != 200:  # until the worker gives a sign of life
            assert up.poll() is None, up.communicate()[1]
            assert time.monotonic() < end, reply.text
            time.sleep(0.1)
        assert reply.json()["worker"] == "ok"
