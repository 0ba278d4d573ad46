"""Pre-training on random mazes as a job (Sec. 3.1.4): weights for new runs, in the database."""

from __future__ import annotations

import time
from typing import Any

from parenting.agent.policy import network_for
from parenting.agent.pretraining_loop import WINDOW, Pretrainer
from parenting.envs import registry
from parenting.server import jobs
from parenting.server.db import Database
from parenting.server.errors import NotFound
from parenting.server.job_kinds import PretrainPayload
from parenting.server.jobs import JobClaim
from parenting.server.weights import put_bytes
from parenting.weights.estimate import expected_steps
from parenting.weights.store import SUFFIX, Wanted, packed

SEED = 0
"""The seed of `parenting pretrain`: both make the same weights to the bit."""
TELL_SECONDS = 1.0
"""Seconds between two words on its progress."""
MOST_STEPS = 50_000


def pretrain(db: Database, mine: JobClaim, asked: PretrainPayload) -> dict[str, Any]:
    """Pre-train until converged, and store the weights where runs find them.

    Raises:
        LostClaimError: it was cancelled, or another worker has it.
        NotFound: this worker has no such world.
        RuntimeError: it has not converged.
    """
    if asked.world not in registry.WORLDS:
        raise NotFound(f"There is no world '{asked.world}' where this worker runs.")
    wanted, began = Wanted(registry.spec(asked.world), asked.height, asked.width), time.monotonic()
    expected, told = expected_steps(wanted), began
    network = network_for(wanted.height, wanted.width, len(wanted.metadata["legend"]))
    school = Pretrainer(network, wanted.world.glyphs, SEED)
    state = school.init()
    while not school.converged(state):
        if len(state.returns) >= MOST_STEPS:
            raise RuntimeError(f"pre-training has not converged after {MOST_STEPS} steps")
        state = school.update(state)
        if (now := time.monotonic()) - told >= TELL_SECONDS:
            steps, told = len(state.returns), now
            jobs.tell(db, mine, {"steps": steps, "expected": expected, "seconds": round(now - began, 1)})
    exam, steps = school.evaluate(state.params[0]), len(state.returns)
    mean = float(state.returns[-WINDOW:].mean())
    about = {"seed": str(SEED), "steps": str(steps), "return": f"{mean:.2f}", "solved": f"{exam.solved:.3f}"}
    blob = packed(wanted, state.params[0], about)
    sha256 = put_bytes(db, f"{wanted.name}{SUFFIX}", blob, lambda session: jobs.hold(session, mine))
    took = round(time.monotonic() - began, 1)
    return {"sha256": sha256, "steps": steps, "seconds": took, "solved": round(exam.solved, 4)}
