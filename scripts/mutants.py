"""`make mutants`: apply each fault of tests/mutants in a copy of the tree; its test has to fail.

With `--sabotage` the faults are those of tests/faults/sabotage.py, whose tests `make faults` runs first.

Fails if a text is not found once, if a test fails without its mutant, or if a mutant is not caught.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from tests.faults import seeds
from tests.faults.sabotage import SABOTAGES
from tests.mutants import MUTANTS, Mutant
from tests.tree import LINKS, ROOT, git_files

FAILED = 1
"""pytest's exit code where tests ran and failed; others mean that it could not run them."""
TIMED_OUT = re.compile(r"^E +(Failed: Timeout|TimeoutError)", re.MULTILINE)
"""A test that only waited in vain, by pytest-timeout or by its own bound, has caught nothing."""
FAILURE = re.compile(r"^FAILED ", re.MULTILINE)
"""A line of pytest's summary. An error before the test says that the tree is broken: it caught nothing."""
TOLD = 2000
"""Characters of pytest's output that are printed where a mutant was not caught."""


class Verdict(NamedTuple):
    """The outcome of one mutant."""

    mutant: Mutant
    outcome: str  # caught, or why not
    seconds: float
    output: str

    @property
    def caught(self) -> bool:
        return self.outcome == "caught"


def copy_tree(folder: Path) -> Path:
    """The files of the project, links as links."""
    for name in [*git_files("--cached", "--others", "--exclude-standard"), *LINKS]:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name, follow_symlinks=False)
    return folder


def run_tests(tree: Path, tests: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """pytest in a tree, in one process, up to the first failure."""
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider", *tests]
    return subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True)


def attempt(tree: Path, mutant: Mutant) -> Verdict:
    """Apply a mutant to a tree, run its test, and take the mutant back."""
    file, began = tree / mutant.file, time.monotonic()
    source = file.read_text(encoding="utf-8")
    if source.count(mutant.text) != 1:
        return Verdict(mutant, f"its text stands {source.count(mutant.text)} times in {mutant.file}", 0.0, "")
    file.write_text(source.replace(mutant.text, mutant.replacement), encoding="utf-8")
    try:
        result = run_tests(tree, [mutant.test])
    finally:
        file.write_text(source, encoding="utf-8")
    said = result.stdout + result.stderr
    return Verdict(mutant, outcome_of(result.returncode, result.stdout), time.monotonic() - began, said)


def outcome_of(code: int, said: str) -> str:
    """The outcome by pytest's exit code and report."""
    if code != FAILED:
        return "not caught" if code == 0 else f"pytest could not run (exit code {code})"
    if TIMED_OUT.search(said):
        return "timed out"
    return "caught" if FAILURE.search(said) else "its test was not reached"


def attempt_all(mutants: Sequence[Mutant], trees: Sequence[Path]) -> list[Verdict]:
    """As many mutants at a time as there are trees."""
    free: SimpleQueue[Path] = SimpleQueue()
    for tree in trees:
        free.put(tree)

    def in_a_free_tree(mutant: Mutant) -> Verdict:
        tree = free.get()
        try:
            return attempt(tree, mutant)
        finally:
            free.put(tree)

    with ThreadPoolExecutor(len(trees)) as pool:
        return list(pool.map(in_a_free_tree, mutants))


def print_verdicts(verdicts: Sequence[Verdict], console: Console) -> None:
    """A line a mutant; what pytest said of those that got away."""
    table = Table("mutant", "file", "test", "outcome", "s", box=None, pad_edge=False)
    for verdict in verdicts:
        mutant, style = verdict.mutant, "green" if verdict.caught else "bold red"
        test = mutant.test.rpartition("::")[2]
        table.add_row(mutant.name, mutant.file, test, f"[{style}]{verdict.outcome}", f"{verdict.seconds:.0f}")
    console.print(table)
    for verdict in verdicts:
        if not verdict.caught:
            console.print(f"\n{verdict.mutant.name}: {verdict.outcome}\n", style="bold red")
            console.print(verdict.output[-TOLD:], markup=False, highlight=False)


def main() -> int:
    """Try the mutants whose names contain the words given, or all of them; 0 if each was caught."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*", help="try only mutants whose names contain one of these")
    parser.add_argument("--sabotage", action="store_true", help="try tests/faults/sabotage.py instead")
    parser.add_argument("--sample", type=int, help="try only so many, drawn by PARENTING_FAULTS_SEED")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="mutants at a time")
    asked = parser.parse_args()
    listed = SABOTAGES if asked.sabotage else MUTANTS
    chosen = [m for m in listed if not asked.words or any(word in m.name for word in asked.words)]
    if asked.sample is not None:
        chosen = seeds.draws("sabotage").sample(chosen, min(asked.sample, len(chosen)))
    console, began = Console(width=None if sys.stdout.isatty() else 200), time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        trees = [copy_tree(Path(folder) / str(number)) for number in range(max(1, asked.jobs))]
        # `make faults` has just run the tests of the fault list, and they take minutes.
        tests = [] if asked.sabotage else sorted({mutant.test for mutant in chosen})
        unharmed = run_tests(trees[0], tests) if tests else None
        if unharmed is not None and unharmed.returncode:
            console.print(unharmed.stdout[-TOLD:], markup=False, highlight=False)
            console.print("A test fails without its mutant; mend it first.", style="bold red")
            return 1
        verdicts = attempt_all(chosen, trees)
    print_verdicts(verdicts, console)
    caught = sum(verdict.caught for verdict in verdicts)
    console.print(f"{caught} of {len(verdicts)} mutants caught in {time.monotonic() - began:.0f} s.")
    return 0 if verdicts and caught == len(verdicts) else 1


if __name__ == "__main__":
    sys.exit(main())
