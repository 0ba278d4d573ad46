"""`parenting answer`: a scripted parent as a client of the HTTP API."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from parenting._plural import counted
from parenting.commands.answer_many import answer_many
from parenting.commands.answering import EXITS, Answering, Ending, Order, Told
from parenting.commands.client import Client, RefusedError, UnavailableError
from parenting.commands.crowd import Plan, Thinking
from parenting.commands.errors import UsageError, friendly_errors
from parenting.commands.parents import chosen_parent
from parenting.commands.printing import say
from parenting.commands.progress import bar
from parenting.envs import registry

Until = Literal["optimal", "over"]


def answer(
    run: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="The run's number; `parenting runs` lists them.",
            show_default="none; --people has --runs",
        ),
    ] = None,
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
    people: Annotated[
        int | None,
        typer.Option(min=1, max=1000, help="Answer as so many people at once.", show_default="one script"),
    ] = None,
    think: Annotated[
        float, typer.Option(min=0, max=3600, metavar="SECONDS", help="With --people: how long each thinks.")
    ] = 1.0,
    thinking: Annotated[
        Thinking, typer.Option(help="With --people: thinking times vary, or are all the same.")
    ] = "exponential",
    runs: Annotated[
        str | None,
        typer.Option(
            metavar="N,N-N",
            help="With --people: the runs, over which people spread.",
            show_default="all that people answer",
        ),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(metavar="WORLD", help="With --people: start a run for each.", show_default="none"),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.1, help="With --people: end after this long.", show_default="when all is over"),
    ] = None,
) -> None:
    """Answer a run's questions as the scripted parent does (Sec. 3.1.3), or another, over the HTTP API.

    The script knows the rules of the worlds and the question, nothing else. Web and worker may stop and come
    back meanwhile: an answer is sent until the server has confirmed it. The command ends after --limit
    answers, when the run is over or has reached its goal, or as --until says, whichever comes first.

    With --people a crowd answers many runs at once, each person with a connection and a name: it leases,
    thinks, answers, and waits for the next question. Live counts go to standard error; at the end come
    percentiles of the wait for the next question and of the answer's request. --limit counts all answers.

    Exit codes: 0 one of these ends was reached; 1 the run failed, asked nothing for --timeout seconds, or
    found no acceptable action; 2 the run or the server does not exist, or an option is wrong; 130 stopped by
    Ctrl-C.

    Example: parenting answer --url http://localhost:8765 --run 3 --limit 50
    """
    with friendly_errors(), ExitStack() as stack:
        spec = chosen_parent(parent)
        client = Client(url)
        stack.callback(client.close)
        if people is not None:
            _only_one_way(run, runs, start, until, receipts)
            plan = Plan(people, think, thinking, limit, seconds, timeout, end_episodes)
            raise typer.Exit(answer_many(client, plan, spec, runs, start, as_json))
        if run is None:
            raise UsageError("--run: name a run to answer, or with --people how many people answer many.")
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


def _only_one_way(
    run: int | None, runs: str | None, start: str | None, until: Until | None, receipts: Path | None
) -> None:
    """Refuse what does not go with --people.

    Raises:
        UsageError: one of the options was given.
    """
    alone = {"--run": run, "--until": until, "--receipts": receipts}
    given = [name for name, value in alone.items() if value is not None]
    if given:
        raise UsageError(f"{given[0]}: it does not go with --people. Leave one of them out.")
    if runs is not None and start is not None:
        raise UsageError("--runs: with --start the crowd answers what it starts. Leave one of them out.")


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
