"""Lint that holds the pages' scripts to the supported browsers: it passes, and finds what one lacks."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
LINT = ROOT / "scripts" / "browsers"
SUPPORTED = "Chrome and Edge 105, Firefox 104, Safari 15.4"
PLANTED = {
    "numbers.toSorted();": "'Array.prototype.toSorted'",
    "Object.groupBy(numbers, String);": "'Object.groupBy'",
    "numbers.union(numbers);": "'Set.prototype.union'",
    "Promise.withResolvers();": "'Promise.withResolvers'",
    "/(?<=a)b/.test(numbers);": "lookbehind",
    "(class { static { numbers(); } });": "static block",
    "new URLPattern(numbers);": "URLPattern",
    "scheduler.postTask(numbers);": "scheduler",
}
"""Things that some supported browser lacks, and a part of what lint says about each."""
SPARED = "numbers.map(String).filter(Boolean).findLast(String).at(-1); navigator.locks.query(); fetch('/');"


def lint(*arguments: str, script: str | None = None) -> list[dict[str, Any]]:
    """Lint files or a script: what it has to say about each."""
    if not (LINT / "node_modules").is_dir():
        if os.environ.get("CI"):
            pytest.fail("scripts/browsers has no node_modules: .ci/run installs them.")
        pytest.skip("only CI needs it; npm ci --prefix scripts/browsers installs it")
    command: list[str | Path] = [
        LINT / "node_modules/.bin/eslint",
        "--config",
        LINT / "eslint.config.js",
        "--format",
        "json",
    ]
    done = subprocess.run([*command, *arguments], cwd=ROOT, input=script, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    found: list[dict[str, Any]] = json.loads(done.stdout)
    return found


def test_scripts_of_the_pages_run_in_the_supported_browsers() -> None:
    found = lint("web/static")
    assert {Path(one["filePath"]).name for one in found} == {
        path.name for path in (ROOT / "web" / "static").glob("*.js")
    }
    assert [(one["filePath"], said) for one in found for said in one["messages"]] == []


@pytest.mark.slow
def test_what_one_of_them_lacks_is_found_line_by_line() -> None:
    script = "\n".join([SPARED, *PLANTED])
    (found,) = lint("--stdin", "--stdin-filename", "web/static/planted.js", script=script)
    said = {(one["line"], one["message"]) for one in found["messages"]}
    for line, part in enumerate(PLANTED.values(), start=2):
        assert [message for at, message in said if at == line and part in message], (part, said)
    assert {line for line, _ in said} == set(range(2, 2 + len(PLANTED))), said


def test_lock_file_names_no_host_and_fixes_every_version() -> None:
    lock = json.loads((LINT / "package-lock.json").read_text())
    packages = {name: one for name, one in lock["packages"].items() if name}
    assert [name for name, one in packages.items() if "resolved" in one or not one["integrity"]] == []
    wanted = json.loads((LINT / "package.json").read_text())["devDependencies"]
    assert {name: packages[f"node_modules/{name}"]["version"] for name in wanted} == wanted


def test_supported_browsers_are_named_in_the_docs_as_lint_knows_them() -> None:
    config = (LINT / "eslint.config.js").read_text()
    for browser in ("chrome 105", "edge 105", "firefox 104", "safari 15.4"):
        assert f'"{browser}"' in config
    for page in ("docs/runs.md", "CONTRIBUTING.md"):
        assert SUPPORTED in " ".join((ROOT / page).read_text().split())
