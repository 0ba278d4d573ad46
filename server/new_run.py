"""New runs; each field is checked on its own and has its own message.

This module imports no torch.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    StringConstraints,
    ValidationError,
)
from sqlalchemy.orm import Session

from parenting.agent.config import PRESETS, Config, merge, too_large
from parenting.envs import registry
from parenting.envs.art import LEVEL_CHARACTERS
from parenting.envs.levels.spec import Level, LevelError
from parenting.envs.names import UnknownNameError, did_you_mean
from parenting.envs.people_text import LONGEST, plain, read_name
from parenting.parents.grammar import SCRIPTED, read_script
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError
from parenting.server.finishes import PATTERN, never_met, usual
from parenting.server.identity import unused_number
from parenting.server.patterns import LINE
from parenting.server.run_limits import require_room
from parenting.server.store.relay import announce
from parenting.server.tables import Run
from parenting.server.weights import INHERITED, needed, put_in
from parenting.server.weights import put as put_weights
from parenting.server.whole import WHOLE, whole
from parenting.server.wrong_fields import messages
from parenting.weights.cost import BOUND, Bound, estimate
from parenting.weights.estimate import MOST_SECONDS, seconds
from parenting.weights.origin import NO_ORIGIN, Origin
from parenting.weights.store import NoWeightsError, Wanted, digest

LARGEST_INT = 2**53 - 1
"""The largest integer that every JSON reader keeps exactly."""
COLUMNS = {
    "world",
    "preset",
    "seed",
    "parent",
    "name",
    "goal",
    "pace",
    "guidance_layout",
    "practice",
    "words",
    "remarks",
}
"""The fields that are columns of the run as they are."""
Wrong = list[tuple[str, str]]
PRETRAIN = "config.pretrain"
"""The field that is wrong where pre-trained weights are missing."""

Name = Annotated[str, StringConstraints(min_length=1, max_length=100, pattern=LINE), AfterValidator(plain)]
LevelText = Annotated[
    str, StringConstraints(min_length=1, max_length=LEVEL_CHARACTERS), AfterValidator(plain)
]
PersonsName = Annotated[
    str,
    StringConstraints(min_length=1, max_length=LONGEST, pattern=LINE),
    AfterValidator(read_name),
]
Script = Annotated[
    str, StringConstraints(min_length=1, max_length=200), AfterValidator(plain), AfterValidator(read_script)
]
End = Annotated[str, StringConstraints(pattern=PATTERN)]
Seed = Annotated[int, Field(ge=0, le=LARGEST_INT), WHOLE]
Goal = Annotated[int, Field(ge=1, le=1_000_000), WHOLE]
Pace = Annotated[float, Field(gt=0, le=1000)]
Integer = Annotated[int, Field(ge=-LARGEST_INT, le=LARGEST_INT)]
Setting = bool | Integer | float | Name | None


class NewRun(BaseModel):
    """The settings of a new run. `level` is a built-in level's name; `config` changes the preset."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)

    world: Name
    level: Name | None = Field(None, description="A built-in level's name; none is the world's first.")
    level_text: LevelText | None = Field(
        None, description="A level of one's own, as text; instead of `level`."
    )
    parent: Literal["human", "scripted"] = "human"
    script: Script | None = Field(
        None,
        description="The errors of a scripted parent, such as noisy:0.1+tiring; null: it never errs.",
    )
    preset: Name = Field("conservative", description="conservative, lax, direct or frugal.")
    config: dict[Name, Setting] = Field(
        default_factory=dict, max_length=100, description="Changes to the preset, by field."
    )
    seed: Seed = 0
    name: PersonsName | None = None
    goal: Goal | None = Field(None, description="Answered questions after which the run rests; null: never.")
    finish: End | None = Field(
        None,
        description="What ends the run: optimal (its argmax policy is), goal:N (it has heard N answers), "
        "stages:T (stage T is over) or never; null: optimal where the parent is scripted, else never.",
    )
    pace: Pace | None = Field(None, description="Ticks a second at most; null: as fast as it can.")
    guidance_layout: Literal["one", "two"] = Field(
        "one", description="Guidance on one board with both moves, or on two boards as in the paper."
    )
    practice: Literal["offered", "required"] = Field(
        "offered", description="required: a parent practises first, once in each browser."
    )
    words: Literal["plain", "guide"] = Field(
        "plain", description="guide: a question in words also tells how long a safe way is after each side."
    )
    remarks: bool = Field(
        True,
        description="Tell the parent of hasty, dangerous and contradictory answers, once in ten questions.",
    )


def start(
    db: Database,
    new: NewRun,
    folder: Path | None = None,
    origin: Origin = NO_ORIGIN,
    bound: Bound = BOUND,
    most: int | None = None,
    fill: Callable[[Session, Run], None] = lambda session, run: None,
) -> Run:
    """Check a new run against worlds and hyperparameters, and add it, with all that it begins with.

    `folder` holds weights of one's own; those of the built-in levels are shipped, and others may be stored.
    `bound` is the most that it may cost, `most` the number of runs that may live (None: any).
    `fill` stores what else belongs to the run, in the same transaction.

    Raises:
        InvalidFieldsError: names every wrong field, with a message each.
        TooManyRunsError: as many live as may.
    """
    columns = plan(new, folder, origin, db, bound)
    if isinstance(columns["weights"], Path):
        columns["weights"] = put_weights(db, columns["weights"])
    hashed = [(digest(blob), name, blob) for name, blob in origin.blobs]
    with db.write() as session:
        if most is not None:
            require_room(session, most)
        for sha256, name, blob in hashed:  # with the run, so that nobody removes them as unused before
            put_in(session, sha256, name + INHERITED, blob, db.clock())
        run = Run(id=unused_number(session, Run), created=db.clock(), **columns)
        session.add(run)
        session.flush()
        fill(session, run)
        announce(session, "worker")
        return run


def plan(
    new: NewRun,
    folder: Path | None = None,
    origin: Origin = NO_ORIGIN,
    db: Database | None = None,
    bound: Bound = BOUND,
) -> dict[str, Any]:
    """The columns of a new run; under `weights` the file or the hash of its pre-trained weights, or None.

    Raises:
        InvalidFieldsError: names every wrong field, with a message each.
    """
    wrong: Wrong = []
    if new.script is not None and new.parent == "human":
        wrong.append(("script", "People answer this run. Errors belong to a run with the parent scripted."))
    level = level_of(new, wrong)
    config = _config(new, level, wrong)
    weights = None if origin.policy is not None else _weights(level, config, folder, db, wrong)
    if level is not None and config is not None:
        spec, field = registry.spec(new.world, level), "level" if new.level_text is None else "level_text"
        wrong += [*origin.misfits(level, config), *never_met(new.finish, spec, config)]
        wrong += bound.misfits(field, estimate(spec, level, config))
    if wrong or level is None or config is None:
        raise InvalidFieldsError(wrong)
    return {
        **new.model_dump(include=COLUMNS),
        "script": _script(new),
        "finish": new.finish or usual(new.parent),
        "level": level.name,
        "level_text": level.text,
        "legend": dict(spec.legend),
        "brief": {"goal": spec.brief.goal, "danger": spec.brief.danger},
        "config": config.model_dump(mode="json"),
        "weights": weights,
        "origin": origin.about,
    }


def _script(new: NewRun) -> str | None:
    return (new.script or str(SCRIPTED)) if new.parent == "scripted" else None


def _unknown(what: str, name: str, known: Collection[str]) -> str:
    return f"There is no such {what}.{did_you_mean(name, known)} There is: {', '.join(known)}."


def level_of(new: NewRun, wrong: Wrong) -> Level | None:
    """The level of a new run; what is wrong with it is added to the list."""
    if not registry.knows(new.world, new.level_text):
        broken = registry.INSTALLED.broken().get(new.world)
        wrong.append(("world", broken or _unknown("world", new.world, registry.WORLDS)))
        return None
    if new.level is not None and new.level_text is not None:
        wrong.append(("level", "Name a level or give its text, not both."))
        return None
    field = "level" if new.level_text is None else "level_text"
    try:
        if new.level_text is None:
            return registry.level(new.world, new.level)
        return registry.read_level(new.world, new.level_text.replace("\r\n", "\n"))
    except UnknownNameError:
        known = registry.spec(new.world, new.level_text).levels
        wrong.append((field, _unknown(f"level of {new.world}", str(new.level), known)))
    except LevelError as error:
        wrong.append((field, str(error)))
    return None


def _config(new: NewRun, level: Level | None, wrong: Wrong) -> Config | None:
    """The preset, over it what the world sets, over it what this run sets (docs/paper.md, "Settings").

    A script answers at once, so its agent waits for each of its answers.
    """
    if new.preset not in PRESETS:
        wrong.append(("preset", _unknown("preset", new.preset, PRESETS)))
        return None
    known = level is not None or new.world in registry.WORLDS
    world = registry.spec(new.world, level).defaults if known else {}
    waits = {"max_open_preferences": 0} if new.parent == "scripted" else {}
    changes = waits | {name: whole(value) for name, value in new.config.items()}
    try:
        # Strict: pydantic would otherwise take true for 1, and "1" too.
        config = Config.model_validate(merge(PRESETS[new.preset], world, changes), strict=True)
    except ValidationError as error:
        for field, message in messages(error.errors()):
            wrong.append(("config" if field == "body" else f"config.{field}", message))
        return None
    wrong += [(f"config.{name}", said) for name, said in too_large(config).items()]
    return config


def _weights(
    level: Level | None, config: Config | None, folder: Path | None, db: Database | None, wrong: Wrong
) -> Path | str | None:
    if level is None or config is None or not config.pretrain:
        return None
    wanted = Wanted(registry.spec(level.world, level), level.height, level.width)
    try:
        return needed(wanted, folder, db)
    except NoWeightsError as error:
        needs = seconds(wanted)
        by_worker = f" A worker makes them, too (POST /api/v1/jobs, about {needs} s)."
        wrong.append((PRETRAIN, f"{error}{by_worker if needs <= MOST_SECONDS else ''}"))
        return None
