"""`parenting answer --people`: which runs a crowd answers, and what is printed of it."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from typing import Any

from parenting.commands.client import Client, RefusedError, UnavailableError
from parenting.commands.crowd import Crowd, Home, Plan, chosen_runs
from parenting.commands.crowd_figures import live_line, summary
from parenting.commands.errors import UsageError
from parenting.commands.printing import say
from parenting.parents.grammar import ParentSpec

MOST = 200
"""Runs on a page of the API's list."""


def answer_many(
    client: Client, plan: Plan, spec: ParentSpec, runs: str | None, start: str | None, as_json: bool
) -> int:
    """Have a crowd answer, print its figures, and return the exit code.

    Raises:
        UsageError: there is no server or no such run, or none that people answer.
    """
    try:
        found = _started(client, start, plan.people) if start is not None else _found(client, runs)
    except UnavailableError as error:
        raise UsageError(f"--url: {error} Start one with `parenting up`, or name another.") from None
    if not found:
        raise UsageError(
            f"--people: no run at {client.url} lives and is answered by people. Start some: --start WORLD."
        )
    from parenting._process import settle  # loads torch, which takes a second: what is wrong is said before
    from parenting.commands.judge import Judge

    settle()
    homes = [Home(run["public_id"], Judge(spec, run["seed"]), before=run["answers"]) for run in found]
    crowd = Crowd(client, plan, homes)
    asyncio.run(crowd.work(lambda here: _show(crowd, here)))
    took, names = time.monotonic() - crowd.began, [home.public_id for home in homes]
    plain = crowd.figures.plain(plan.people, names, took)
    plain["ended"] = crowd.why
    say(json.dumps(plain) if as_json else f"{summary(plain)}\n{crowd.why}")
    return _exit_code(crowd)


def _exit_code(crowd: Crowd) -> int:
    if crowd.why == "Stopped.":
        return 130
    return 0 if crowd.figures.answered else 1


def _show(crowd: Crowd, here: int) -> None:
    seconds = time.monotonic() - crowd.began
    print(live_line(crowd.figures, here, seconds), file=sys.stderr, flush=True)


def _started(client: Client, world: str, people: int) -> list[dict[str, Any]]:
    """Start a run for each person, with the seeds 0, 1, 2 and so on."""
    try:
        return [client.post("runs", world=world, parent="human", seed=seed) for seed in range(people)]
    except RefusedError as error:
        raise UsageError(f"--start: {error}") from None


def _found(client: Client, runs: str | None) -> list[dict[str, Any]]:
    if runs is None:
        listed = client.get(f"runs?limit={MOST}")["rows"]
        return [run for run in listed if "damaged" not in run and _answerable(run)]
    found = []
    for number in chosen_runs(runs):
        try:
            run: dict[str, Any] = client.get(f"runs/{number}")
        except RefusedError as error:
            raise UsageError(f"--runs: {error} On its machine `parenting runs` lists them.") from None
        if not _answerable(run):
            raise UsageError(
                f"--runs: run {number} is over, rests, or is answered by a script of its own. Leave it out."
            )
        found.append(run)
    return found


def _answerable(run: dict[str, Any]) -> bool:
    return run["parent"] == "human" and run["worker"] != "done" and not run["resting"]
