"""Questions: how few a parent has to answer, beside bounds and an ideal tabular agent (ours).

The paper counts deaths and queries of three presets (Table 1). Here settings that spare the parent are added
one by one, and the questions that are left are compared with what an agent needs that does not generalise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from parenting.agent import config as agent_config
from parenting.experiments.questions.plot import draw_arms, draw_curves, draw_windows
from parenting.experiments.questions.report import findings, words
from parenting.experiments.questions.settings import (
    ANSWERS,
    ARMS,
    CHOICE_SEED,
    CHOICES,
    GARDEN_MARKS,
    GARDEN_ONE_OF,
    GARDEN_TICKS,
    GARDENERS,
    IDEAL,
    IDEAL_TRIALS,
    ISLANDS,
    LASTING_LIVES,
    LEVELS,
    LONG_LIVES,
    MAZE_STEPS,
    MAZES,
    PARENTED,
    STAGE_TICKS,
    START_AGENTS,
    START_TICKS,
    STARTS,
    TRIALS,
    WINDOW,
    WORLD,
    LongLife,
    trials_of,
)
from parenting.experiments.runner.store import Row, Task
from parenting.experiments.spec import Experiment, Request, Results, chunk_ranges

CALL = "parenting.experiments.questions.tasks"
TOGETHER = 100
"""Trials of a task at most."""


def _config(request: Request) -> Mapping[str, Any]:
    lives = {**LONG_LIVES, **LASTING_LIVES}
    return {
        "frugal": agent_config.PRESETS["frugal"],
        "answers": ANSWERS,
        "window": WINDOW,
        "islands": {name: list(one) for name, one in {**ISLANDS, **STARTS}.items()},
        "variants": {
            **{name: [world, level, *_plain(arm)] for name, (world, level, arm) in ARMS.items()},
            **{name: _plain(life) for name, life in lives.items()},
            **{f"{IDEAL}, {level}": [world] for world, level in LEVELS},
            **{
                name: [world, level, *_plain(arm), CHOICE_SEED]
                for name, (world, level, arm) in CHOICES.items()
            },
            **{name: [preset, GARDEN_TICKS, list(GARDEN_MARKS)] for name, preset in GARDENERS.items()},
        },
    }


def _plain(settings: Sequence[Any]) -> list[Any]:
    return [dict(one) if isinstance(one, Mapping) else one for one in settings]


def _tasks(request: Request) -> list[Task]:
    arms = [task for name in _asked(request) for task in _raised(name, request)]
    starts = {task.key: task for name in _asked(request) for task in _starts(name, request)}
    more = [*_choices(request), *_gardeners(request)] if request.scale == "paper" else []
    return [*_ideal(request), *starts.values(), *arms, *_lives(request), *more]


def _asked(request: Request) -> list[str]:
    """The arms of a scale: the quick one has the first on the island alone."""
    return [name for name, (_, level, _) in ARMS.items() if request.scale == "paper" or name in QUICK]


QUICK = ("frugal, island", "conservative, island", "frugal, pre-parented, island", "random, island")


def _raised(name: str, request: Request) -> list[Task]:
    world, level, arm = ARMS[name]
    life = (world, level, arm.preset, dict(arm.changes), arm.parent)
    needs = tuple(task.key for task in _starts(name, request))
    mine = {"label": name, "life": life, "share": arm.share, "max_ticks": arm.max_ticks, "seed": request.seed}
    return [
        Task(
            _key(name, span, needs),
            f"{CALL}:question_trials",
            {**mine, "span": (span.start, span.stop)},
            arm.cost * len(span),
            needs=needs,
        )
        for span in _spans(name, arm.one_of, request)
    ]


def _starts(name: str, request: Request) -> list[Task]:
    """The task that makes the policies with which an arm begins, if not its own weights."""
    _world, level, arm = ARMS[name]
    given = {"level": level, "preset": arm.preset, "seed": request.seed}
    if arm.start == PARENTED:
        ticks = START_TICKS[request.scale]
        more = {"ticks": ticks, "agents": START_AGENTS}
        return [Task(_named(f"parented {level} {ticks}"), f"{CALL}:parented_policies", given | more, 100.0)]
    if arm.start == MAZES:
        steps = MAZE_STEPS[request.scale]
        more = {"steps": steps}
        return [Task(_named(f"mazes {level} {steps}"), f"{CALL}:maze_policy", given | more, 100.0)]
    return []


def _ideal(request: Request) -> list[Task]:
    few = request.scale == "quick"
    return [
        Task(
            _key(f"{IDEAL}, {level}", span),
            f"{CALL}:ideal_trials",
            {
                "label": f"{IDEAL}, {level}",
                "world": world,
                "level": level,
                "span": (span.start, span.stop),
                "seed": request.seed,
            },
            0.02 * len(span),
        )
        for world, level in (LEVELS[:1] if few else LEVELS)
        for span in chunk_ranges(TOGETHER if few else IDEAL_TRIALS, IDEAL_TRIALS)
    ]


def _lives(request: Request) -> list[Task]:
    lives = [("long_trials", name, life) for name, life in LONG_LIVES.items()]
    lives += [("lasting_trials", name, life) for name, life in LASTING_LIVES.items()]
    return [
        _life(call, name, life, span, request)
        for call, name, life in lives
        if request.scale == "paper" or name in ("frugal, T = 1", next(iter(LASTING_LIVES)))
        for span in _spans(name, life.one_of, request)
    ]


def _life(call: str, name: str, life: LongLife, span: range, request: Request) -> Task:
    ticks = life.ticks[request.scale]
    mine = {
        "label": name,
        "life": (WORLD, life.level, life.preset, dict(life.changes), life.parent),
        "ticks": ticks,
        "span": (span.start, span.stop),
        "seed": request.seed,
    }
    if call == "long_trials":
        mine["stage_ticks"] = STAGE_TICKS[request.scale]
    return Task(_key(f"{name} {ticks}", span), f"{CALL}:{call}", mine, life.cost * len(span))


def _choices(request: Request) -> list[Task]:
    return [
        Task(
            _key(name, span),
            f"{CALL}:question_trials",
            {
                "label": name,
                "life": (world, level, arm.preset, dict(arm.changes), arm.parent),
                "share": arm.share,
                "max_ticks": arm.max_ticks,
                "span": (span.start, span.stop),
                "seed": request.seed + CHOICE_SEED,
            },
            arm.cost * len(span),
        )
        for name, (world, level, arm) in CHOICES.items()
        for span in _spans(name, arm.one_of, request)
    ]


def _gardeners(request: Request) -> list[Task]:
    return [
        Task(
            _key(f"{name} {GARDEN_TICKS}", span),
            "parenting.experiments.questions.garden:garden_trials",
            {
                "label": name,
                "preset": preset,
                "ticks": GARDEN_TICKS,
                "marks": GARDEN_MARKS,
                "span": (span.start, span.stop),
                "seed": request.seed,
            },
            20.0 * len(span),
        )
        for name, preset in GARDENERS.items()
        for span in _spans(name, GARDEN_ONE_OF, request)
    ]


def _spans(name: str, one_of: int, request: Request) -> list[range]:
    return chunk_ranges(trials_of(name, request.trials), min(TRIALS // one_of, TOGETHER))


def _key(name: str, span: range, needs: Sequence[str] = ()) -> str:
    return "-".join([_named(name), *needs, f"{span.start:06d}", f"{span.stop:06d}"])


def _named(text: str) -> str:
    """A name for a file."""
    return "-".join(text.replace(",", "").replace(":", " ").replace("=", " ").split())


def _report(request: Request, rows: Sequence[Row]) -> Results:
    figures = {
        "arms": lambda figure: draw_arms(figure, rows),
        "curves": lambda figure: draw_curves(figure, rows),
        "windows": lambda figure: draw_windows(figure, rows),
    }
    return Results(findings(rows), words(rows), figures)


EXPERIMENT = Experiment(
    name="questions",
    title="Questions: a third of them",
    section="",
    claim="An agent that asks what it does not know, and nothing twice, spares its parent most questions.",
    trials={"quick": 3, "paper": TRIALS},
    config=_config,
    tasks=_tasks,
    report=_report,
)
