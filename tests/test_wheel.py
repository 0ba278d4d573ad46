"""The wheel carries everything that the program needs: code, pages and migrations."""

import ast
import atexit
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Iterable
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from tests.tree import LINKS, ROOT, git_files

FOLDERS = tuple(Path(link).name for link in LINKS)


def files_of_the_project() -> list[str]:
    """The files that git tracks or would track: no caches, no leftovers of an earlier build."""
    return git_files("--cached", "--others", "--exclude-standard")


def copy_tree(source: Path) -> Path:
    """The files of the project, links as links."""
    for name in [*files_of_the_project(), *LINKS]:
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, source / name, follow_symlinks=False)
    return source


def build_wheel(folder: Path) -> Path:
    """Built from a copy: it leaves nothing in the tree, and takes nothing from an earlier build."""
    return pip_wheel(copy_tree(folder / "source"), folder / "wheel")


@cache
def wheel_of_the_tree() -> Path:
    """Built once a process."""
    folder = tempfile.mkdtemp(prefix="parenting-wheel-")
    atexit.register(shutil.rmtree, folder)
    return build_wheel(Path(folder))


def build_sdist(folder: Path) -> Path:
    """The archive of sources, built from a copy as well."""
    source, target = copy_tree(folder / "source"), folder / "sdist"
    target.mkdir()
    code = f"from setuptools.build_meta import build_sdist; build_sdist({str(target)!r})"
    result = subprocess.run([sys.executable, "-c", code], cwd=source, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    (built,) = target.glob("parenting-*.tar.gz")
    return built


def pip_wheel(source: Path, target: Path) -> Path:
    """A wheel of a folder or of an archive of sources."""
    # No isolation: the build uses the setuptools at hand and needs no network.
    options = ["--quiet", "--disable-pip-version-check", "--no-deps", "--no-build-isolation", "--no-index"]
    command = [sys.executable, "-m", "pip", "wheel", *options, "--wheel-dir", str(target), str(source)]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout + result.stderr
    (built,) = target.glob("parenting-*.whl")
    return built


@pytest.fixture(scope="module")
def wheel() -> zipfile.ZipFile:
    return zipfile.ZipFile(wheel_of_the_tree())


def test_wheel_carries_exactly_the_files_of_our_folders(wheel: zipfile.ZipFile) -> None:
    ours = {f"parenting/{name}" for name in files_of_the_project() if name.split("/")[0] in FOLDERS}
    ours |= {name for name in files_of_the_project() if name.startswith("parenting/")}
    carried = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert carried == ours
    assert all(name.startswith("parenting/") for name in carried)


@pytest.mark.slow
def test_wheel_of_the_sdist_is_that_of_the_tree(wheel: zipfile.ZipFile, tmp_path: Path) -> None:
    """Same names, same bytes: the links are files in the archive, and no file is there under two names."""
    built = build_sdist(tmp_path)
    with tarfile.open(built) as archive:
        names = [name.partition("/")[2] for name in archive.getnames()]
        assert not any(member.issym() or member.islnk() for member in archive)
    flat = [name for name in names if name.split("/")[0] in FOLDERS and name.endswith(".py")]
    assert flat == []
    other = zipfile.ZipFile(pip_wheel(built, tmp_path / "wheel"))
    files = [name for name in wheel.namelist() if ".dist-info/" not in name]
    assert sorted(name for name in other.namelist() if ".dist-info/" not in name) == sorted(files)
    assert [name for name in files if wheel.read(name) != other.read(name)] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("folder", "suffix"),
    [
        ("parenting/web/templates/", ".html"),
        ("parenting/web/static/", ".js"),
        ("parenting/web/static/", ".css"),
        ("parenting/migrations/", "env.py"),
        ("parenting/migrations/versions/", ".py"),
    ],
)
def test_wheel_carries_pages_and_migrations(wheel: zipfile.ZipFile, folder: str, suffix: str) -> None:
    assert [name for name in wheel.namelist() if name.startswith(folder) and name.endswith(suffix)]


def test_wheel_installs_the_command(wheel: zipfile.ZipFile) -> None:
    (entry,) = [name for name in wheel.namelist() if name.endswith("entry_points.txt")]
    assert "parenting = parenting.__main__:main" in wheel.read(entry).decode()


def imported_by(source: str, deep: bool = True) -> set[str]:
    """The top-level names that it imports; not `deep`: only those that it needs to be imported itself."""
    tree = ast.parse(source)
    nodes = list(ast.walk(tree)) if deep else tree.body
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    return {name.split(".")[0] for name in names}


@pytest.mark.slow
def test_wheel_requires_what_its_code_imports(wheel: zipfile.ZipFile) -> None:
    """The tests run with the dev extra, so only this test misses a library that a plain install lacks.

    What an extra brings may be imported inside functions, where it is asked for.
    """
    (metadata,) = [name for name in wheel.namelist() if name.endswith("METADATA")]
    text = wheel.read(metadata).decode()
    required = plain_names(re.findall(r"^Requires-Dist: ([\w.-]+)(?!.*extra ==)", text, re.M))
    extras = "figures|dask|minari|parquet|postgres"
    extra = plain_names(re.findall(rf"^Requires-Dist: ([\w.-]+).*extra == .(?:{extras})", text, re.M))
    code = [wheel.read(name).decode() for name in wheel.namelist() if name.endswith(".py")]
    assert lacking(set().union(*map(imported_by, code)), required | extra) == set()
    assert lacking(set().union(*(imported_by(one, deep=False) for one in code)), required) == set()


def plain_names(names: Iterable[str]) -> set[str]:
    return {name.lower().replace("_", "-") for name in names}


def lacking(imported: set[str], required: set[str]) -> set[str]:
    """The packages that are imported and not required."""
    known = packages_distributions()
    others = imported - {"parenting"} - sys.stdlib_module_names
    return {name for name in others if not required & plain_names(known.get(name, [name]))}
