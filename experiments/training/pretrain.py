"""Pre-training as long work: with progress, interrupted and taken up again, and what it leaves as files."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import torch

from parenting.agent.policy import network_for
from parenting.agent.pretraining_loop import EvalResult, Pretrainer, TrainState
from parenting.agent.state import Rehearsal
from parenting.weights import store
from parenting.weights.store import Wanted

SAVE_SECONDS = 10.0
"""Seconds of work that an interruption may cost."""
SMOOTH = 50
"""The curve's rows: a mean over so many steps each."""
RENAMED = {"live": "params", "moments.first": "moments.exp_avg", "moments.second": "moments.exp_avg_sq"}
"""The names of tensors in the interrupted work of version 0.1, and their names today."""

Progress = Callable[[int, float], None]
"""Told (steps, mean return of the last steps)."""


class UnconvergedError(RuntimeError):
    """Pre-training did not converge within its steps; what was learnt is kept and can be taken up again."""


class DamagedWorkError(RuntimeError):
    """The file of interrupted work cannot be read; the sentence names it."""


class PretrainResult(NamedTuple):
    """The files and the measurements that pre-training leaves."""

    path: Path
    sha256: str
    steps: int
    mean_return: float  # of the last 300 steps
    exam: EvalResult
    curve: list[float]  # mean return, a value for every SMOOTH steps


def pretrain(
    wanted: Wanted, folder: Path, seed: int, max_steps: int, progress: Progress | None = None
) -> PretrainResult:
    """Pre-train until converged (Sec. 3.1.4) and write weights and curve into `folder`.

    Interrupted work stands in a file beside them, and the next call goes on from there to the same bits.

    Raises:
        UnconvergedError: `max_steps` were not enough.
        DamagedWorkError: the interrupted work cannot be read.
        OSError: `folder` cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    school = Pretrainer(
        network_for(wanted.height, wanted.width, len(wanted.metadata["legend"])), wanted.world.glyphs, seed
    )
    part = folder / f"{wanted.name}-seed{seed}.part"
    train_state = _recall(part, school.init())
    saved = time.monotonic()
    try:
        while not school.converged(train_state):
            if len(train_state.returns) >= max_steps:
                raise UnconvergedError(
                    f"{wanted.name} has not converged after {max_steps} steps: call again with more."
                )
            train_state = school.update(train_state)
            if progress:
                progress(len(train_state.returns), float(train_state.returns[-SMOOTH:].mean()))
            if time.monotonic() - saved > SAVE_SECONDS:
                _keep(part, train_state)
                saved = time.monotonic()
    except BaseException:
        _keep(part, train_state)
        raise
    return _finish(wanted, folder, seed, school, train_state, part)


def _finish(
    wanted: Wanted, folder: Path, seed: int, school: Pretrainer, train_state: TrainState, part: Path
) -> PretrainResult:
    exam, steps = school.evaluate(train_state.params[0]), len(train_state.returns)
    mean = float(train_state.returns[-300:].mean())
    about = {"seed": str(seed), "steps": str(steps), "return": f"{mean:.2f}", "solved": f"{exam.solved:.3f}"}
    path = folder / f"{wanted.name}{store.SUFFIX}"
    sha256 = store.save(path, wanted, train_state.params[0], about)
    curve = [float(some.mean()) for some in torch.split(train_state.returns, SMOOTH)]
    path.with_suffix(".csv").write_text(_table(curve), encoding="utf-8")
    part.unlink(missing_ok=True)
    return PretrainResult(path, sha256, steps, mean, exam, curve)


def _table(curve: list[float]) -> str:
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["step", "mean_return"])
    rows.writerows((SMOOTH * (place + 1), f"{value:.3f}") for place, value in enumerate(curve))
    return out.getvalue()


def _keep(part: Path, train_state: TrainState) -> None:
    """Write the whole state of training, or leave the older file as it is."""
    fresh = part.with_suffix(".keep")
    torch.save(train_state.tensors(), fresh)
    fresh.replace(part)


def _recall(part: Path, train_state: TrainState) -> TrainState:
    if not part.is_file():
        return train_state
    blob = io.BytesIO(part.read_bytes())
    try:
        stored: dict[str, Any] = torch.load(blob, weights_only=True)
        kept = {RENAMED.get(name, name): part for name, part in stored.items()}
        moments = {name: kept[f"moments.{name}"] for name in ("exp_avg", "exp_avg_sq", "steps", "owed")}
        found = TrainState(kept["params"], Rehearsal(**moments), kept["tick"], kept["returns"]).check()
    except Exception:  # torch has many errors for what it cannot read
        found = train_state.replace(params=train_state.params[:, :0])
    if found.params.shape != train_state.params.shape:
        raise DamagedWorkError(f"{part} cannot be read as interrupted work. Delete it to start again.")
    return found
