"""Never committed: a path of one machine, the host of a registry, a long file, a vendored library."""

import re
from pathlib import Path

import pytest

from parenting.server.settings import Settings
from tests.tree import ROOT, git_files

LINES = 300
COLUMNS = 1000

MACHINE_PATH = re.compile(r"(?<![\w.~}-])/(?:work|root|home)(?:/|(?=[\s\"'`:;,)]|$))")
REGISTRY = re.compile(r"pypi\.org|pythonhosted\.org|pytorch\.org/whl|registry\.npmjs|--(?:extra-)?index-url")
LIBRARY = re.compile(r"(?:alpine|bootstrap|chart|d3|htmx|jquery|plotly|preact|react|vue)\b.*\.(?:css|js|mjs)")


def tracked() -> list[Path]:
    return [ROOT / name for name in git_files()]


def lines_of(path: Path) -> list[str]:
    """Its lines; none for a binary file."""
    data = path.read_bytes()
    return [] if b"\0" in data else data.decode().splitlines()


def lines_with(pattern: re.Pattern[str]) -> list[str]:
    return [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in tracked()
        for number, line in enumerate(lines_of(path), start=1)
        if pattern.search(line)
    ]


def is_vendored(path: Path) -> bool:
    """It bears the name of a library, or it has been minified: nobody writes lines so long."""
    if path.suffix not in {".css", ".js", ".mjs"}:
        return False
    return bool(LIBRARY.fullmatch(path.name)) or any(len(line) > COLUMNS for line in lines_of(path))


def test_there_are_tracked_files() -> None:
    assert ROOT / "pyproject.toml" in tracked()


def test_no_path_of_one_machine() -> None:
    assert lines_with(MACHINE_PATH) == []


def test_no_host_of_a_registry() -> None:
    assert lines_with(REGISTRY) == []


def test_no_long_python_file() -> None:
    """A file of more lines is a room that wants a wall."""
    sizes = {str(path.relative_to(ROOT)): len(lines_of(path)) for path in tracked() if path.suffix == ".py"}
    assert {name: size for name, size in sizes.items() if size > LINES} == {}


def test_no_browser_library_is_vendored() -> None:
    """Plotly is served from the installed package; the pages are our own small modules."""
    assert [str(path.relative_to(ROOT)) for path in tracked() if is_vendored(path)] == []


def test_patterns_find_what_they_are_for() -> None:
    for name in ("work", "root", "home"):
        assert MACHINE_PATH.search(f'open("/{name}/me/file")')
        assert MACHINE_PATH.search(f"HOME=/{name}")
        assert not MACHINE_PATH.search(f"docs/{name}/page and net{name}")
    assert REGISTRY.search("https://" + "pypi" + ".org/simple")
    assert REGISTRY.search("pip install --" + "index-url somewhere")
    assert all(LIBRARY.fullmatch(name) for name in ("plotly.min.js", "plotly-2.js", "htmx.js", "d3.v7.js"))
    assert not any(LIBRARY.fullmatch(name) for name in ("charts.js", "play.js", "parent.css", "draw.mjs"))


def test_example_of_the_settings_lists_each_with_its_default(monkeypatch: pytest.MonkeyPatch) -> None:
    example = re.findall(r"^# (PARENTING_\w+)=(.*)$", (ROOT / ".env.example").read_text(), re.MULTILINE)
    assert {name for name, _ in example} == {f"PARENTING_{name.upper()}" for name in Settings.model_fields}
    for name, _ in example:
        monkeypatch.delenv(name, raising=False)
    defaults = Settings()
    for name, value in example:
        if name not in {"PARENTING_DATA", "PARENTING_DATABASE_URL"}:  # these two depend on the machine
            monkeypatch.setenv(name, value)
    assert Settings() == defaults
