"""`train`: agents from tick 0 to the end of their training, by any parent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from parenting.agent.config import Config
from parenting.agent.parent import BatchParent
from parenting.agent.parent import Parent as AnyParent
from parenting.envs.levels.spec import Level
from parenting.envs.rng import keys
from parenting.envs.tables.world import TableWorld
from parenting.experiments.training import batch
from parenting.experiments.training.batch import BatchTrainer, MakeParent
from parenting.experiments.training.chunks import chunks
from parenting.experiments.training.counts import Progress as BatchProgress
from parenting.experiments.training.stop_rule import StopRule
from parenting.library.answer_log import AnswerLog
from parenting.library.batch_parent import LoggedParent, WholeBatch
from parenting.library.beginnings import origin_of
from parenting.library.checks import check_callback, check_number, check_parent, check_progress
from parenting.library.interrupted import Batches
from parenting.library.parent import EndedError, Parent
from parenting.library.person import Person, TerminalParent
from parenting.library.policy import Policy
from parenting.library.progress import Progress, bar
from parenting.library.result import TrainResult, collect
from parenting.library.scripted import ScriptedParent
from parenting.library.task import Task, prepare, stop_rule
from parenting.library.threads import one_thread
from parenting.library.tracking import Trackers, Tracking, feeds_of
from parenting.library.worlds import AnyLevel, World
from parenting.parents.fallible import FallibleParent, FallibleRule
from parenting.parents.grammar import ParentError, read_parent
from parenting.parents.scripted import ScriptedParent as BatchScripted

Callback = Callable[[Progress], bool | None]


def train(
    world: str | World | Level | TableWorld,
    *,
    level: AnyLevel | None = None,
    preset: str | Config = "conservative",
    parent: str | AnyParent | Person = "scripted",
    trials: int = 1,
    until: str = "optimal",
    seed: int = 0,
    callback: Callback | None = None,
    progress: bool | None = None,
    max_ticks: int = 20_000,
    from_policy: str | Path | Policy | None = None,
    from_answers: str | Path | None = None,
    trackers: Trackers = None,
    **changes: Any,
) -> TrainResult:
    """Train agents by PARENTING (Sec. 2): they ask, a parent answers, and no reward is read.

    Args:
        world: A world's name, a `World`, a level's text whose header names its world, a
            `Level`, or a `TableWorld`.
        level: A built-in level's name, a level's text, a file's path, or a `Level`; None takes the default.
        preset: A name in `PRESETS` ("conservative", "lax", "direct": Table 1; "frugal": ours), or a `Config`.
        parent: "scripted" (Sec. 3.1.3), a parent who errs such as "noisy:0.1" (docs/commands.md, "Parents who
            err"), a `Parent` such as one's own, or a `Person`.
        trials: Number of agents. Trial i of a seed is the same agent whatever the number of trials is.
        until: When a trial is finished: "optimal" (its argmax policy takes a shortest safe path),
            "queries:N" (N answered queries) or "ticks:N".
        seed: Seed of all randomness, from 0 to 2**53 - 1.
        callback: Called with a `Progress` after each tick; training ends early where it returns False. Trials
            that have not begun by then have 0 ticks.
        progress: Show a progress bar; None shows one on a terminal.
        max_ticks: Ticks after which a trial is left unfinished.
        from_policy: Begin with the weights of a `Policy` or its file, not with fresh or pre-trained ones.
        from_answers: Begin with X of the answers of an export (`parenting export`) that stand.
        trackers: "csv:FOLDER", "jsonl:FOLDER", "tensorboard:FOLDER", a `Tracker` of one's own, or several.
            One trial is told while it is trained; of several each is a run of its own, told once its batch
            has ended.
        **changes: Hyperparameters that differ from the preset, by their names in `Config`.

    Returns:
        The policies, the counts of each trial and all answers.

    Raises:
        KeyboardInterrupt: Ctrl-C. Its attribute `partial` is the `TrainResult` of the trials that had ended
            by then, None without any. With a `Person` there is a result instead.
        UnknownNameError: There is no such world or level; the message names the nearest.
        UnknownPresetError: There is no such preset; the message names the nearest.
        LevelError: A level breaks a rule; the message names line and column.
        TypeError: An argument is not known; the message names the nearest.
        ValueError: An argument has a wrong value; the message names it, the value and the remedy.

    Example:
        >>> import parenting as pt
        >>> result = pt.train("unsafe-exploration", trials=3, progress=False)
        >>> result
        <TrainResult unsafe-exploration, level island: 3 trials, 3 finished, 0 unsafe steps>
    """
    task = prepare(world, level, preset, changes, origin_of(from_policy, from_answers))
    rule = stop_rule(task.world, until)
    trials = check_number("trials", trials, 1, 1_000_000)
    seed = check_number("seed", seed, 0, 2**53 - 1)
    max_ticks = check_number("max_ticks", max_ticks, 1, 10**9)
    check_callback(callback)
    check_progress(progress)
    tracking = Tracking(feeds_of(trackers), trials)
    if isinstance(parent, Person):
        if trials != 1:
            raise ValueError(f"trials: a person raises one agent at a time, not {trials}.")
        if parent.where == "page":
            if trackers is not None:
                raise ValueError("trackers: a worker raises this agent. Set PARENTING_TRACKERS instead.")
            from parenting.library.page_training import train_on_page  # loads the server

            return train_on_page(task, rule, seed, parent, callback, progress)
        terminal = TerminalParent(parent.after)
        with terminal.listening(), tracking.of(task, seed):
            result, ended = _train(task, rule, terminal, trials, seed, (callback,), max_ticks, tracking)
        if ended:
            print(terminal.how_to_go_on())
        return result
    with bar(progress, trials, rule) as show, tracking.of(task, seed):
        return _train(task, rule, parent, trials, seed, (show, callback), max_ticks, tracking)[0]


def _train(
    task: Task,
    rule: StopRule,
    parent: str | AnyParent,
    trials: int,
    seed: int,
    told: tuple[Callback | None, ...],
    max_ticks: int,
    tracking: Tracking,
) -> tuple[TrainResult, bool]:
    """Train in batches, one after the other; whether somebody ended it before its time."""
    log, batches, ended = AnswerLog(), Batches(trials), False
    behind, parts = _parent(parent, task, trials), batches.ended
    known: dict[str, Any] = {"seed": seed, "until": str(rule), "max_ticks": max_ticks}

    def collected(of: Sequence[batch.TrainResult], numbers: Sequence[int]) -> TrainResult:
        about = {**known, "parent": _name(behind), "events": log.events, "numbers": numbers}
        return collect(task, of, log.records(), **about)

    with one_thread(), batches.kept(collected):
        for chunk in chunks(trials):
            made = _logged(behind, log, task, trials, chunk)
            trainer = _trainer(task, rule, seed, chunk, made, tracking.wants_history and not ended)
            if ended:  # before these have begun
                parts.append(_ended(trainer))
                continue
            batches.begun(chunk, trainer)
            report = tracking.watching(trainer, _report(chunk, trials, parts, told))
            trained, ended = _run(trainer, max_ticks, report)
            parts.append(trained)
            tracking.ended(trainer, chunk, rule)
    return collected(parts, range(trials)), ended


def _parent(parent: str | AnyParent, task: Task, trials: int) -> AnyParent | FallibleRule | None:
    """Return a parent of the caller's, ready for these trials; None stands for the scripted one."""
    if parent == "scripted" or type(parent) is ScriptedParent:  # a subclass may answer otherwise
        return None
    if isinstance(parent, str):
        try:
            spec = read_parent(parent)
        except ParentError as error:
            raise ValueError(f"parent: {error}") from None
        return FallibleRule(task.world, spec, task.config.gamma, task.config.garden_parent)
    known = check_parent(parent)
    if isinstance(known, Parent):
        known.begin(task.world, task.config, trials)
    return known


def _name(parent: AnyParent | FallibleRule | None) -> str:
    """Return a parent's name for a reader of the result: that of a stored run, or its class."""
    match parent:
        case None:
            return "scripted"
        case FallibleRule():
            return str(parent.spec)
        case TerminalParent():
            return "human"
    return f"{type(parent).__module__}.{type(parent).__qualname__}"


def _logged(
    own: AnyParent | FallibleRule | None, log: AnswerLog, task: Task, trials: int, chunk: range
) -> MakeParent:
    """Return how a batch's parent is made: the caller's own or the scripted one, its answers written down."""

    def make(scripted: BatchScripted, done: Callable[[], Tensor]) -> BatchParent:
        heard: BatchParent = scripted
        if isinstance(own, FallibleRule):
            heard = FallibleParent(own, scripted.query)
        elif own is not None:
            heard = WholeBatch(own, task, trials, chunk, done)
        return LoggedParent(heard, log, chunk)

    return make


def _trainer(
    task: Task, rule: StopRule, seed: int, chunk: range, parent: MakeParent, history: bool
) -> BatchTrainer:
    mine = keys(seed, chunk.stop, task.world.device).pick(torch.arange(chunk.start, chunk.stop))
    begun: dict[str, Any] = {"weights": task.weights, "beginning": task.beginning, "history": history}
    return BatchTrainer(task.world, task.config, mine, rule, parent=parent, **begun)


def _run(
    trainer: BatchTrainer, max_ticks: int, report: Callable[[BatchProgress], None]
) -> tuple[batch.TrainResult, bool]:
    """Train one batch to its end, or to where somebody ends it; whether somebody did."""
    try:
        return trainer.run(max_ticks, report), False
    except EndedError:
        return _ended(trainer), True


def _ended(trainer: BatchTrainer) -> batch.TrainResult:
    """Return the result of a batch where it is."""
    trainer.save(~trainer.counts.done)
    return batch.TrainResult(trainer.result, trainer.policies, trainer.evaluation)


def _report(
    chunk: range, trials: int, before: list[batch.TrainResult], told: tuple[Callback | None, ...]
) -> Callable[[BatchProgress], None]:
    """Tell how far the whole run has come after each tick of one batch."""
    done = sum(int(one.counts.done.sum()) for one in before)
    queries = sum(int(one.counts.queries.sum()) for one in before)

    def tell(now: BatchProgress) -> None:
        progress = Progress(done + now.trials, trials, now.ticks, queries + now.queries)
        answers = [callback(progress) for callback in told if callback]  # each is called
        if False in answers:
            raise EndedError

    return tell
