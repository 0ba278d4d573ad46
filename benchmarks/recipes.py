"""Seconds of each recipe of docs/guide-researchers.md, for whoever copies its blocks into an empty folder.

    git clone . ../fresh && cd ../fresh && python -m benchmarks.recipes        all, or with a word: "Table 1"

The packages are installed before. The first recipe is left out, since a person answers in it, and so is
what needs Stable-Baselines3 where that is not installed. A recipe that fails ends this.
"""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.library.test_recipes import BLOCK, RECIPES

ROOT = Path(__file__).resolve().parent.parent
BY_HAND = "Raise an agent by hand"
EXTRA = "stable_baselines3"
COMMAND = f'set -e\nparenting() {{ "{sys.executable}" -m parenting.commands.main "$@"; }}\n'


def followed(recipe: str, folder: Path) -> list[str]:
    """Run the blocks of a recipe, those of Python as one program; return what was left out."""
    paths = [str(ROOT), ".", *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PARENTING_")}
    environment |= {"PARENTING_DATA": "data", "PYTHONPATH": os.pathsep.join(paths)}
    program, left_out = "", []
    for language, body in BLOCK.findall(RECIPES[recipe]):
        if EXTRA in body and importlib.util.find_spec(EXTRA) is None:
            left_out.append(EXTRA)
        elif language == "sh":
            run(["bash", "-c", COMMAND + body], folder, environment)
        elif found := re.match(r"# (\w+\.py)\n", body):
            (folder / found[1]).write_text(body, encoding="utf-8")
        elif language == "python":
            program += body
    if program:
        run([sys.executable, "-c", program], folder, environment)
    return left_out


def run(command: list[str], folder: Path, environment: dict[str, str]) -> None:
    """Run a program, whose output is shown where it fails."""
    ended = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    if ended.returncode:
        raise SystemExit(f"{command[-1]}\n{ended.stdout}{ended.stderr}")


def main() -> None:
    """Follow the recipes, or those whose names hold an argument, in one folder; print a line for each."""
    words = sys.argv[1:] or [""]
    with tempfile.TemporaryDirectory() as folder:
        for recipe in RECIPES:
            if recipe == BY_HAND or not any(word in recipe for word in words):
                continue
            began = time.monotonic()
            left_out = followed(recipe, Path(folder))
            without = f" (without {', '.join(left_out)})" if left_out else ""
            print(f"{time.monotonic() - began:5.0f} s  {recipe}{without}", flush=True)


if __name__ == "__main__":
    main()
