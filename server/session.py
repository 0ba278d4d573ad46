"""One run in a worker: its agent, its parent, its checkpoints and its metrics."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import structlog

from parenting.agent import parenting
from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.agent.query import Answer, Query, QueryKind
from parenting.evaluation.argmax import evaluation
from parenting.parents.fallible import FallibleRule
from parenting.parents.grammar import SCRIPTED, read_parent
from parenting.parents.scripted import ScriptedRule
from parenting.server import checkpoints, metrics
from parenting.server.begun import inherited
from parenting.server.board.writer import BoardWriter
from parenting.server.checkpoint_pace import CheckpointPace
from parenting.server.checkpoint_parts import sweep_parts
from parenting.server.codec import encode, kind_name
from parenting.server.counters import count
from parenting.server.damage import readable
from parenting.server.db import Database
from parenting.server.finishes import read_finish
from parenting.server.growth import Growth
from parenting.server.lived import Lived
from parenting.server.machine import diverged, follow, take_up
from parenting.server.metrics_row import NOTHING_LEARNT, Row, learnt, measure
from parenting.server.optimality import Optimality
from parenting.server.pressure import ALONE, Pressure, PutOff
from parenting.server.progress import report_progress
from parenting.server.queue import worker_side
from parenting.server.queue.queue_parent import QueueParent, ScriptedQueueParent
from parenting.server.queue.worker_side import Watch
from parenting.server.readiness import may_live_on, surely_waits_for, waits_for
from parenting.server.recall import recall
from parenting.server.runs import Claim
from parenting.server.snapshot import Snapshot, initial_weights, pack
from parenting.server.statuses import Waiting
from parenting.server.tables import Run
from parenting.server.why import Why

log = structlog.get_logger()

LOOK_SHARE = 0.1
"""The share of time at most that evaluations of the policy take, where one is expensive."""
METRIC_SECONDS = 1.0
HURRY_SECONDS = 1.0
"""For this long after an answer, no metrics and no checkpoint delay the next question. An agent that walks
farther than this asks seldom, and what it does is to be seen."""


class RunSession:
    """A run that a worker raises, from tick 0 or its last checkpoint until something ends it."""

    def __init__(
        self,
        db: Database,
        claim: Claim,
        run: Run,
        asked: Callable[[], None],
        pressure: Pressure = ALONE,
    ) -> None:
        """Take up a run where its last good checkpoint left it, or at tick 0."""
        self.db, self.claim, self.run = db, claim, run
        config = Config.model_validate(run.config)
        self.world = world_of(run.world, run.level_text, config)
        rule = ScriptedRule(self.world, config.gamma, inside=config.garden_parent)
        self.evaluation = evaluation(self.world, rule.values, config.gamma)
        self.parent = self._parent(config, rule, asked)
        self._recalled = recall(db, run, self.world, config, initial_weights(db, run, self.world))
        self.saved = self._recalled.saved
        self.parent.inherited = inherited(db, run, self.world, config)
        self.record_ends = self.parent.record_ends = worker_side.high_water(db, claim.run_id)
        self.growth = Growth(self.world, run, self.evaluation, self.saved.state, self.saved.tally)
        self.lived = Lived(self.world, db, claim, self.saved)
        self.board = BoardWriter(self.world, db, claim, self.evaluation, self.saved, pressure)
        self.why = Why(self.world, db, claim, self.saved, self.growth.lesson)
        self.finish, self.waiting, self.stage = read_finish(run.finish), run.waiting, run.maturity
        self.optimality = Optimality(self.finish, self.evaluation, self.saved.state, run.optimal)
        self._pace, self._rest = CheckpointPace(pressure=pressure), PutOff(pressure)
        self._saved_tick = self._measured_tick = self.last_tick
        self.lived_at = self._measured_at = self._heard_at = self._look_cost = 0.0
        self._stuck_at, self._news, self.over = -1, False, False  # over: somebody has stopped it
        self.told: Callable[[int, Row], None] = lambda tick, row: None  # trackers take each row of metrics
        self.whole, self._told, self._told_at, self._learnt = True, False, 0.0, NOTHING_LEARNT
        sweep_parts(db, claim)  # of a worker that was killed while it wrote a checkpoint
        self.parent.follow_until = take_up(db, claim, run, self._recalled, self.record_ends)

    def _parent(self, config: Config, rule: ScriptedRule, asked: Callable[[], None]) -> QueueParent:
        if self.run.parent == "scripted":
            spec = read_parent(self.run.script or str(SCRIPTED), imports=False)
            script = FallibleRule(self.world, spec, config.gamma, config.garden_parent, rule)
            return ScriptedQueueParent(self.db, self.claim, self.world, config, asked, script)
        return QueueParent(self.db, self.claim, self.world, config, asked)

    @property
    def last_tick(self) -> int:
        """Return the last tick that has passed."""
        return int(self.saved.state.keys.tick[0])

    # When it may live on

    def ready(self, seen: Watch) -> bool:
        """Return whether the next tick may pass: an agent never outruns its parent (docs/queue.md)."""
        return self.last_tick < self.record_ends or may_live_on(self.saved, seen)

    def report_waiting(self, seen: Watch) -> None:
        """Report who waits for whom, and save a checkpoint: no tick passes for a while."""
        if self._news:
            self._measure(at_once=False)
        reason = waits_for(self.saved, seen)
        if reason != self.waiting or (reason is Waiting.STUCK and self.last_tick != self._stuck_at):
            self.waiting, self._stuck_at = reason, self.last_tick
            report_progress(self.db, self.claim, tick=self.last_tick, waiting=reason)
        self._do_the_rest()

    def catch_up(self) -> None:
        """Do what was put off, but for an expensive look at the policy, where no tick passes for a while."""
        if self.unmeasured and not self.evaluation.refresh_seconds:
            self._measure(at_once=False)
        self.why.write_if_due()

    @property
    def unmeasured(self) -> bool:
        """Return whether a row of metrics is still to come of what has happened."""
        return self._news

    def rests_until(self) -> float:
        """Return when a run that waits has to report again though nothing has happened; `inf` for never."""
        due = min(self.board.next_portion(), self.why.due)
        if self.unsaved:
            due = min(due, self._pace.next)
        return min(due, self._measured_at + self._look_every) if self._news else due

    def delay(self, pace: float | None) -> float:
        """Return the seconds until the next tick may pass at this pace; replayed ticks need not wait."""
        if pace is None or self.last_tick < self.record_ends:
            return 0.0
        return max(0.0, self.lived_at + 1 / pace - time.monotonic())

    # A tick

    def tick(self, seen: Watch | None = None) -> bool:
        """One tick; whether the next may follow at once, because nothing was asked and nothing is awaited.

        `seen` is what a look at the mailbox has just shown; a tick right after another does not look. A
        session that is not `whole` afterwards was left amid a tick by an error, and is of no more use.
        """
        began, self.whole = time.monotonic(), False
        replayed = self.last_tick < self.record_ends
        parent = self.parent.looking(
            answers=replayed or bool(seen and seen.answers),
            events=replayed or bool(seen and (seen.events or seen.corrections)),
        )
        state, query, answer, config, events = parenting.tick(
            self.world, self.saved.config, self.saved.state, self.growth.overhear(parent)
        )
        self.lived_at = time.monotonic()
        self._pace.work += self.lived_at - began
        tally = count(self.world, self.saved.tally, answer, state, events)
        self.saved = Snapshot(state, tally, config)
        self.growth.see(state, tally)
        self.lived.see(state, tally, events)
        self.board.see(state, tally, answer)
        self.why.see(self.saved, query)
        self.optimality.see(state)
        if self.last_tick <= self.record_ends:
            self._hold_to_the_record(query)
        self._note(answer)
        at_once = not bool(state.waiting) and bool(query.kind[0] == QueryKind.NONE)
        hurried = at_once and self.lived_at - self._heard_at < HURRY_SECONDS
        later = not hurried and self._rest.may_wait()
        unmeasured = later and self.finish.kind != "optimal"  # that one is seen by a row of metrics
        self._news |= unmeasured  # its row comes with the next turn
        self._measure(at_once, hurried or unmeasured)
        self.whole = True
        if not (hurried or later):
            self._do_the_rest()
        return at_once

    def _do_the_rest(self) -> None:
        self.board.go_on(self.saved)
        self.why.write_if_due()
        self.save_if_due()

    def _hold_to_the_record(self, query: Query) -> None:
        """Compare a replayed tick with its record, which another machine may have written.

        Raises:
            DivergedError: the tick asks something else than on the same machine before. The log tells the
                checkpoint that the run went on from, which is passed over from now on.
        """
        stored = worker_side.asked_at(self.db, self.claim.run_id, self.last_tick)
        recorded = None if stored is None else (stored.kind, readable(stored).clips, stored.votes)
        kind = kind_name(query)
        if recorded == (None if kind is None else (kind, encode(self.world, query), int(query.votes[0]))):
            return
        if self.last_tick > self.parent.follow_until:
            diverged(self.db, self.claim, self.run, self._recalled, self.last_tick, self.record_ends)
            self.parent.follow_until = self.record_ends
        asked = None if stored is None else self.parent.read(stored)
        self.saved = self.saved._replace(state=follow(self.saved.state, asked, query))
        self.lived.forget(self.saved.state)
        self.why.forget(self.last_tick)

    def _note(self, answer: Answer) -> None:
        """Keep what the next row of metrics needs of this tick."""
        if answer.choice[0]:
            self._news, self._heard_at = True, self.lived_at
        if bool(self.saved.state.info.trained):
            self._learnt = learnt(self.saved)

    def _measure(self, at_once: bool, later: bool = False) -> None:
        """Write a row of metrics after the parent was heard, and once a second besides.

        It waits until the next question is out: a person waits for that, and nobody for a row. Where a look
        at the policy is expensive, as in the garden, the evaluation waits `refresh_seconds` between two rows,
        or longer where it would take more than `LOOK_SHARE` of the time.
        The tick that ends a stage has its row in any case: a stage is judged by what it ended with.
        """
        late, stage = time.monotonic() - self._measured_at, int(self.saved.state.maturity[0])
        due = not later and (late >= METRIC_SECONDS or (self._news and not at_once))
        if stage == self.stage and (not due or late < self._look_every):
            self._report_tick()
            return
        speed = (self.last_tick - self._measured_tick) / late if self._measured_at and late else None
        began = time.monotonic()
        row = {**measure(self.saved, self.evaluation), **self._learnt, "speed": speed}
        row |= self.growth.row(self.saved.state)
        optimal = bool(row["optimal"])
        shown: dict[str, Any] = {"maturity": row["maturity"], "speed": speed, "optimal": optimal}
        sure = self.run.parent == "human" and not self.over
        reason = surely_waits_for(self.saved) if sure else None
        shown |= {"tick": self.last_tick, "waiting": reason, **self.growth.news(self.saved.state)}
        metrics.write_metrics(self.db, self.claim, {self.last_tick: row}, shown)
        self.told(self.last_tick, row)
        self.optimality.measured(optimal)
        self.waiting, self.stage, self._news = reason, stage, False
        self._measured_at, self._measured_tick = time.monotonic(), self.last_tick
        self._look_cost = self._measured_at - began

    def _report_tick(self) -> None:
        """Report the tick alone, once a second, where the next look at the policy is far off."""
        now = time.monotonic()
        if self._look_every > METRIC_SECONDS and now - self._told_at >= METRIC_SECONDS:
            self._told_at, self.waiting = now, None
            report_progress(self.db, self.claim, tick=self.last_tick, waiting=None)

    @property
    def _look_every(self) -> float:
        """Return the seconds between two rows of metrics, where a look at the policy is expensive."""
        least = self.evaluation.refresh_seconds
        return max(least, self._look_cost / LOOK_SHARE) if least else 0.0

    def finished(self) -> bool:
        """Return whether its rule ends the run, which first goes back to where it was before a restart."""
        if self.finish.kind == "never" or self.last_tick < max(self.record_ends, self.run.tick or 0):
            return False
        return self.optimality.ends(self.saved)

    # Checkpoints

    @property
    def unsaved(self) -> bool:
        """Return whether a tick has passed since the last checkpoint."""
        return self.last_tick != self._saved_tick

    def end(self) -> None:
        """Measure what the last tick has changed, and save."""
        if self._news:
            self._measured_at = 0.0  # whatever a look costs: it is the last
            self._measure(at_once=False)
        self.save(last=True)

    def save_if_due(self) -> None:
        """Save a checkpoint if the last one is old and a tick has passed since."""
        if self.unsaved and self._pace.due:
            self.save()

    def save(self, last: bool = False) -> None:
        """Write a checkpoint, with a whole snapshot if it is the `last` for now; large ones seldom."""
        began = time.monotonic()
        self.lived.write()
        self.board.write(self.saved, last)
        self.why.write()
        blob = pack(self.saved)
        checkpoints.save_checkpoint(self.db, self.claim, self.last_tick, blob)
        self._saved_tick = self.last_tick
        self._pace.saved(time.monotonic() - began, len(blob))
        if self._pace.large and not self._told:
            self._told = True
            log.warning(
                f"checkpoints of {len(blob) / 1e6:.0f} MB: one every {self._pace.every:.0f} s",
                run=self.claim.run_id,
            )
