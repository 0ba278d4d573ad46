"""`parenting answer`: a scripted parent as a client of the HTTP API."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from parenting._plural import counted
from parenting.commands.answering import EXITS, Answering, Ending, Order, Told
from parenting.commands.client import Client, RefusedError, UnavailableError
from parenting.commands.errors import UsageError, friendly_errors
from parenting.commands.parents import chosen_parent
from parenting.commands.printing import say
from parenting.commands.progress import bar
from parenting.envs import registry

Until = Literal["optimal", "over"]


def answer(
    run: Annotated[int, typer.Option(min=1, help="The run's number; `parenting runs` lists them.")],
    url: Annotated[str, typer.Option(help="The server's address.")] = "http://localhost:8765",
    limit: Annotated[
        int | None,
        typer.Option(min=1, help="End after this many answers.", show_default="all that are asked for"),
    ] = None,
    until: Annotated[
        Until | None,
        typer.Option(
            help="End once the agent's argmax policy is optimal, or only when the run is over.",
            show_default="optimal; over with --limit, and in reward-hacking",
        ),
    ] = None,
    timeout: Annotated[
        float, typer.Option(min=0.1, metavar="SECONDS", help="Give up after this long without a question.")
    ] = 60,
    end_episodes: Annotated[
        bool, typer.Option("--end-episodes", help="If no action is acceptable, end the episode.")
    ] = False,
    parent: Annotated[
        str,
        typer.Option(metavar="NAME[:KEY=VALUE,...]", help="The parent; `parenting parents` lists them."),
    ] = "scripted",
    client_id: Annotated[
        str, typer.Option(help="The name to answer under; two scripts that answer one run need two names.")
    ] = "scripted",
    receipts: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Append the server's receipt of each stored answer, as a line of JSON."
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON and nothing else.")
    ] = False,
) -> None:
    """Answer a run's questions as the scripted parent does (Sec. 3.1.3), or another, over the HTTP API.

    The script knows the rules of the worlds and the question, nothing else. Web and worker may stop and come
    back meanwhile: an answer is sent until the server has confirmed it. The command ends after --limit
    answers, when the run is over or has reached its goal, or as --until says, whichever comes first.

    Exit codes: 0 one of these ends was reached; 1 the run failed, asked nothing for --timeout seconds, or
    found no acceptable action; 2 the run or the server does not exist, or an option is wrong; 130 stopped by
    Ctrl-C.

    Example: parenting answer --url http://localhost:8765 --run 3 --limit 50
    """
    with friendly_errors(), ExitStack() as stack:
        spec = chosen_parent(parent)
        client = Client(url)
        stack.callback(client.close)
        found = _first_look(client, run)
        optimal = _until(found["world"], until, limit) == "optimal"
        order = Order(
            found["public_id"], client_id, limit, optimal, timeout, end_episodes, before=found["answers"]
        )
        keep = _receipts(receipts, stack)
        show = stack.enter_context(bar("answers"))
        from parenting._process import (
            settle,  # loads torch, which takes a second: what is wrong is said before
        )
        from parenting.commands.judge import Judge

        settle()

        def stored(receipt: dict[str, Any]) -> None:
            keep(receipt)
            show(work.told.answered, limit or found["goal"])

        work = Answering(client, order, Judge(spec, found["seed"]), stored)
        ending = _work(work)
    say(_as_json(run, work.told, ending) if as_json else _said(run, work.told, ending))
    raise typer.Exit(EXITS[ending.kind])


def _work(work: Answering) -> Ending:
    try:
        return work.work()
    except KeyboardInterrupt:
        return Ending("ctrl-c", "Stopped.")


def _first_look(client: Client, run: int) -> dict[str, Any]:
    """Return the run, if a script may answer it from outside.

    Raises:
        UsageError: it may not, or the server or the run does not exist.
    """
    try:
        found: dict[str, Any] = client.get(f"runs/{run}")
    except UnavailableError as error:
        raise UsageError(f"--url: {error} Start one with `parenting up`, or name another.") from None
    except RefusedError as error:
        if error.status != 404:
            raise UsageError(f"--url: {error}") from None
        raise UsageError(f"--run: {error} On the server's machine `parenting runs` lists them.") from None
    if found["parent"] == "scripted":
        raise UsageError(
            f"--run: the worker itself answers run {run}, since it was started with the parent 'scripted'. "
            "Start one with the parent 'human' to answer it from here."
        )
    return found


def _until(world: str, until: Until | None, limit: int | None) -> Until:
    """Return when to end: at an optimal policy, which the garden does not have, or when the run is over."""
    endless = world in registry.WORLDS and not registry.spec(world).ends_at_goal
    if until == "optimal" and endless:
        raise UsageError(
            f"--until: no policy counts as optimal in {world}, which has no goal. Use --limit, or give "
            "the run a goal of answers."
        )
    return until or ("over" if endless or limit is not None else "optimal")


def _receipts(file: Path | None, stack: ExitStack) -> Callable[[dict[str, Any]], None]:
    """Return a function that appends a receipt to the file, at once.

    Raises:
        UsageError: the file cannot be written.
    """
    if file is None:
        return lambda receipt: None
    try:
        lines = stack.enter_context(file.open("a", encoding="utf-8", buffering=1))
    except OSError as error:
        raise UsageError(f"--receipts: {file} cannot be written: {error.strerror}.") from None
    return lambda receipt: print(json.dumps(receipt), file=lines)


def _said(run: int, told: Told, ending: Ending) -> str:
    by_choice = ", ".join(f"{number} {choice}" for choice, number in told.choices.most_common())
    lines = f"Run {run}: answered {told.answered}" + (f" ({by_choice})" if by_choice else "")
    if told.skipped:
        lines += f"; skipped {told.skipped}"
    if told.unneeded:
        lines += f"; {told.unneeded} needed no answer any more"
    if told.episodes:
        lines += f"; ended {counted(told.episodes, 'episode')}"
    return f"{lines}. {ending.sentence}"


def _as_json(run: int, told: Told, ending: Ending) -> str:
    counts = {choice: told.choices[choice] for choice in ("left", "right", "either", "neither")}
    said = {"run": run, "answered": told.answered, "choices": counts}
    said |= {"skipped": told.skipped, "unneeded": told.unneeded, "episodes_ended": told.episodes}
    return json.dumps({**said, "ended": ending.kind, "sentence": ending.sentence})
