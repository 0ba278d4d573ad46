"""`train` by a person on the page: a run of the server, watched until it ends, and read back as a result."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from parenting._plural import counted
from parenting.experiments.training.stop_rule import StopRule
from parenting.library.notebook import LiveLine, open_page
from parenting.library.page_run import all_heard, begin, read_back
from parenting.library.page_server import address, failure, running_server
from parenting.library.person import Person
from parenting.library.progress import Progress
from parenting.library.result import TrainResult
from parenting.library.task import Task
from parenting.server import runs
from parenting.server.access.roles import Role
from parenting.server.access.tokens import make
from parenting.server.db import Database, connect
from parenting.server.migrate import upgrade
from parenting.server.reads.schemas import run_schema
from parenting.server.schemas import RunSchema
from parenting.server.settings import Settings
from parenting.server.statuses import OVER, RunStatus

LOOK_SECONDS = 0.1
SETTLE_SECONDS = 10.0
Callback = Callable[[Progress], bool | None]


def train_on_page(
    task: Task, rule: StopRule, seed: int, person: Person, callback: Callback | None, progress: bool | None
) -> TrainResult:
    """Let a person raise one agent on the page."""
    folder = person.folder()
    settings = Settings() if folder is None else Settings(data=folder)
    db = connect(settings)
    try:
        upgrade(db)
        run = begin(db, settings, task, rule, seed, person)
        if person.url is None:
            ended = _with_own_server(db, settings.data, run, rule, person, callback, progress)
        else:
            ended = _joined(db, person.url.rstrip("/"), run, rule, person, callback, progress)
        if ended and runs.get_run(db, run).status not in OVER:
            runs.set_status(db, run, RunStatus.STOPPED, f"It came to the end that was set: {rule}.")
        if person.url is not None:
            _settle(db, run)
        result = read_back(db, run, task, rule, seed)
    finally:
        db.close()
    if not ended:
        print(_how_to_go_on(result, settings.data, run, person))
    return result


def _with_own_server(
    db: Database,
    data: Path,
    run: int,
    rule: StopRule,
    person: Person,
    callback: Callback | None,
    progress: bool | None,
) -> bool:
    """Watch the run while a server of our own serves it; whether it came to its end."""
    with running_server(data) as process:
        try:
            open_page(address(process, data) + _path(db, run), person.browser)

            def check() -> None:
                if process.poll() is not None:
                    raise failure(data)

            return _watch(db, run, rule, callback, progress, check)
        except KeyboardInterrupt:
            return False


def _joined(
    db: Database,
    url: str,
    run: int,
    rule: StopRule,
    person: Person,
    callback: Callback | None,
    progress: bool | None,
) -> bool:
    """Watch the run while another server serves it; whether it came to its end."""
    open_page(url + _path(db, run), person.browser)
    try:
        return _watch(db, run, rule, callback, progress, lambda: None)
    except KeyboardInterrupt:
        return False


def _path(db: Database, run: int) -> str:
    """Return the address of the parent's page below that of the server, which lets one browser in."""
    token = make(db, "opening", Role.RESEARCHER, made_by="parenting.Person")
    return f"/open?token={token.secret}&to=/runs/{runs.get_run(db, run).public_id}/parent"


def _watch(
    db: Database,
    run: int,
    rule: StopRule,
    callback: Callback | None,
    progress: bool | None,
    check: Callable[[], None],
) -> bool:
    """Wait until the run ends, or until the callback says so."""
    line = LiveLine(progress)
    try:
        while True:
            now = run_schema(db, run)
            done = _is_done(now, rule) and all_heard(db, run)
            line.show(f"Run {run}: {now.state.value}, tick {now.tick}, {counted(now.standing, 'answer')}")
            if callback and callback(Progress(int(done), 1, now.tick, now.standing)) is False:
                return True
            if done or now.status in OVER:
                return True
            check()
            time.sleep(LOOK_SECONDS)
    finally:
        line.end()


def _is_done(now: RunSchema, rule: StopRule) -> bool:
    match rule.kind:
        case "optimal":
            # else its worker ends it, at the very tick; a row of metrics may come later
            return now.optimal and now.finish != "optimal"
        case "queries":
            return now.resting
        case "ticks":
            return now.tick >= rule.number


def _settle(db: Database, run: int) -> None:
    """Wait until the worker of another server has saved what it lived."""
    from parenting.server import checkpoints

    end = time.monotonic() + SETTLE_SECONDS
    while time.monotonic() < end:
        saved = checkpoints.load_checkpoints(db, run)
        if saved and saved[0].tick >= runs.get_run(db, run).tick:
            return
        time.sleep(LOOK_SECONDS)


def _how_to_go_on(result: TrainResult, data: Path, run: int, person: Person) -> str:
    where = f'url="{person.url}", ' if person.url else f'data="{data}", '
    are = "is" if len(result.answers) == 1 else "are"
    return (
        f"Stopped. {counted(len(result.answers), 'answer')} {are} kept in {data}, as run {run}.\n"
        f"To go on, train with the same arguments and parent=pt.Person({where}run={run})."
    )
