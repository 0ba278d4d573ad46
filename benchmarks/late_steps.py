"""Nine gradient steps an answer: all before the next question, or eight of them after it, or one alone.

    python -m benchmarks.late_steps               40 answers of each kind and 100 trials; needs Chromium
    python -m benchmarks.late_steps --quick       6 answers and 20 trials

More steps on each answer spare questions, and lie between a key and the next question, unless they are taken
late: one before the next question is drawn, the rest once it is posted (`late_steps`). Two tables:

- *a person waits*: milliseconds from an answer to the next question in the database, and from a key to the
  next question on the screen of headless Chromium, as in `benchmarks.answers`. The three agents are asked in
  rotation, so that other work on the machine meets all of them alike, and the last column divides each median
  by that of one step.
- *answers and deaths*: agents in one batch, raised by the scripted parent until optimal, with their means and
  95 % confidence intervals.

Both use one agent's settings, changed in `gradient_steps` and `late_steps` alone.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import tempfile
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from statistics import median
from typing import Any

import httpx2
import torch
from playwright.sync_api import Page

from benchmarks.answers import PATIENCE, SEED, THINKS, Line, answer, begin, press
from benchmarks.in_page import PROBE
from parenting.experiments.reporting.comparison import ci_text, mean_sd
from parenting.experiments.training.tasks import Goal, parent_trials
from parenting.server.store.sqlite import sqlite_module
from tests.access import cookies_in
from tests.simulated_person import chromium, up

WORLD = "unsafe-exploration"
LEVELS = ("island", "island-bottleneck")
AGENTS: Mapping[str, Mapping[str, Any]] = {
    "one step": {"gradient_steps": 1},
    "nine, all before": {"gradient_steps": 9},
    "nine, eight late": {"gradient_steps": 9, "late_steps": True},
}
ANSWERS, QUICK_ANSWERS = 40, 6
TRIALS, QUICK_TRIALS = 100, 20
MAX_TICKS = 2000


def stored(web: httpx2.Client, data: Path, preset: str, answers: int) -> Iterator[Line]:
    """From an answer by HTTP to the next question in the database, the agents in rotation."""
    runs = {name: begin(web, WORLD, preset, p_pref=0.0, **changes) for name, changes in AGENTS.items()}
    store = sqlite_module().connect(f"file:{data / 'parenting.db'}?mode=ro", uri=True, isolation_level=None)
    draws, times = random.Random(SEED), {name: list[float]() for name in AGENTS}
    for _ in range(answers):
        for name, run in runs.items():
            times[name].append(answer(web, store, run, draws)[1])
    store.close()
    for run in runs.values():
        web.post(f"/api/v1/runs/{run}/stop").raise_for_status()
    yield from (Line("next stored", name, found) for name, found in times.items())


def shown(pages: Mapping[str, Page], answers: int) -> Iterator[Line]:
    """From a key to the next question on the screen, the agents in rotation."""
    draws, times = random.Random(SEED), {name: list[float]() for name in AGENTS}
    for _ in range(answers):
        for name, page in pages.items():
            page.bring_to_front()
            page.wait_for_selector("#question[data-listening]", timeout=1e3 * PATIENCE)
            found = press(page, draws.uniform(*THINKS), draws.choice(("a", "b")))
            times[name].append(found["screen"])
    yield from (Line("on the screen", name, found) for name, found in times.items())


def waits(preset: str, answers: int) -> Iterator[Line]:
    """All times that a person waits; nothing else runs meanwhile."""
    path = os.environ.get("PARENTING_CHROMIUM") or shutil.which("chromium") or "chromium"
    with tempfile.TemporaryDirectory() as folder, up(data := Path(folder)) as url:
        web = httpx2.Client(base_url=url, timeout=PATIENCE)
        time.sleep(3)  # both processes have loaded what they need
        yield from stored(web, data, preset, answers)
        with chromium(path) as browser:
            pages = {}
            for name, changes in AGENTS.items():
                run = begin(web, WORLD, preset, p_pref=0.0, **changes)
                context = browser.new_context(viewport={"width": 1280, "height": 800})
                context.add_cookies(cookies_in(data, url))
                page = context.new_page()
                page.add_init_script(PROBE)
                page.goto(f"{url}/runs/{run}/parent")
                pages[name] = page
            yield from shown(pages, answers)
        web.close()


def raised(preset: str, trials: int) -> Iterator[str]:
    """Questions and deaths of each agent on both levels, a row each."""
    for level in LEVELS:
        for name, changes in AGENTS.items():
            chunks = [(first, min(first + 100, trials)) for first in range(0, trials, 100)]
            goal: tuple[Goal, int] = ("optimal", 0)
            rows = [
                row
                for span in chunks
                for row in parent_trials(
                    name, WORLD, level, preset, dict(changes), goal, MAX_TICKS, span, SEED
                )
            ]
            done = [row for row in rows if row["finished"]]
            questions = [float(row["guidance"] + row["preference"]) for row in done]
            deaths = [float(row["deaths"]) for row in done]
            cells = (mean_sd(questions), ci_text(questions), mean_sd(deaths), ci_text(deaths))
            told = "".join(f"{cell:>17}" for cell in cells)
            yield f"{level:19}{name:18}{told}{len(rows) - len(done):12}"


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description="One gradient step an answer, nine before, or nine late.")
    parser.add_argument("--preset", default="conservative", help="of all agents [default: conservative]")
    parser.add_argument("--quick", action="store_true", help="few answers and trials")
    said = parser.parse_args()
    torch.set_num_threads(1)
    print(f"{os.cpu_count()} cores, load average {os.getloadavg()[0]:.2f} at the start, {said.preset}\n")
    print(f"{'a person waits':16}{'':18}{'n':>4}{'median':>9}{'p95':>9}{'min':>9}{'max':>9}{'to one':>9}")
    first: dict[str, float] = {}
    for line in waits(said.preset, QUICK_ANSWERS if said.quick else ANSWERS):
        first.setdefault(line.kind, median(line.times))
        told = "".join(f"{number:9.1f}" for number in line.numbers().values())
        ratio = median(line.times) / first[line.kind]
        print(f"{line.kind:16}{line.world:18}{len(line.times):4}{told}{ratio:9.2f}", flush=True)
    heads = "".join(f"{head:>17}" for head in ("questions", "95 %", "deaths", "95 %"))
    print(f"\n{'answers and deaths':19}{'':18}{heads}{'unfinished':>12}")
    for row in raised(said.preset, QUICK_TRIALS if said.quick else TRIALS):
        print(row, flush=True)


if __name__ == "__main__":
    main()
