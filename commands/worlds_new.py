"""`parenting worlds new`: a package of one's own with a world, to begin from."""

from __future__ import annotations

import keyword
import re
from pathlib import Path
from string import Template
from typing import Annotated

import typer

from parenting.commands.errors import UsageError, friendly_errors, reason
from parenting.commands.printing import say
from parenting.envs import registry

SKELETON = Path(__file__).parent / "skeleton"
FILES = {
    "pyproject.toml": "pyproject.toml",
    "README.md": "README.md",
    "init.py": "{module}/__init__.py",
    "spec.py": "{module}/spec.py",
    "rules.py": "{module}/rules.py",
    "test.py": "tests/test_{module}.py",
}
"""The templates in `commands/skeleton`, each with the file that is written of it."""
NAME = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
LONGEST = 40


def command(
    name: Annotated[str, typer.Argument(help="Name of the world: lower-case words joined by hyphens.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Folder of the package.", show_default="one of the world's name"),
    ] = None,
) -> None:
    """Write the skeleton of a package with a world of your own.

    The package has a small world with lava that works at once, its tests, and the entry point by which all
    commands, pages and workers find it once it is installed.

    Exit codes: 0 written; 2 wrong input.

    Example: parenting worlds new lava-cave
    """
    with friendly_errors():
        folder = Path(name) if out is None else out
        write_skeleton(_free(name), folder)
    say(f"{folder} holds the world '{name}'. Next: cd {folder} && pip install -e '.[dev]' && pytest")


def write_skeleton(name: str, folder: Path) -> None:
    """Write the package of a world into a folder.

    Raises:
        UsageError: the folder is there already and holds something, or cannot be written to.
    """
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise UsageError(f"--out: {folder} is there already. Name a folder that is new or empty.")
        given = {"name": name, "module": name.replace("-", "_"), "title": name.replace("-", " ").title()}
        for template, place in FILES.items():
            text = (SKELETON / f"{template}.txt").read_text(encoding="utf-8")
            file = folder / place.format(**given)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(Template(text).substitute(given), encoding="utf-8")
    except OSError as error:
        raise UsageError(f"--out: {folder} cannot be written to: {reason(error)}.") from None


def _free(name: str) -> str:
    """Return a name that a world, its package and its module may have.

    Raises:
        UsageError: it may not, or a world has it already.
    """
    module = name.replace("-", "_")
    if not NAME.fullmatch(name) or len(name) > LONGEST or keyword.iskeyword(module):
        raise UsageError(
            f"NAME: '{name}' cannot be the name of a world. Write lower-case words joined by hyphens, such as"
            f" lava-cave, of at most {LONGEST} characters."
        )
    if name in registry.WORLDS or name == "parenting":
        raise UsageError(f"NAME: there is a world or package '{name}' already. Choose another name.")
    return name
