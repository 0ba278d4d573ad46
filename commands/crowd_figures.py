"""The figures of a crowd: counts, and percentiles of what its people waited for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import quantiles
from typing import Any

from parenting._plural import counted

SHARES = {"p50": 49, "p90": 89, "p99": 98}
KINDS = ("guidance", "preference")


@dataclass
class Figures:
    """The figures of a crowd so far."""

    answers: Counter[str] = field(default_factory=Counter)
    """Stored answers, by run."""
    waits: dict[str, list[float]] = field(default_factory=lambda: {kind: [] for kind in KINDS})
    """Seconds from a stored answer to the same person's next question, by the kind of that."""
    requests: list[float] = field(default_factory=list)
    """Seconds of each request that stored an answer."""
    skipped: int = 0
    unneeded: int = 0  # withdrawn or answered by somebody else meanwhile
    episodes: int = 0  # ended, since no action was acceptable
    errors: Counter[str] = field(default_factory=Counter)
    """Requests that the server did not serve and that were sent again, by its sentence."""

    @property
    def answered(self) -> int:
        """Answers that are stored."""
        return self.answers.total()

    def all_waits(self) -> list[float]:
        """Return the waits for questions of both kinds."""
        return [wait for kind in KINDS for wait in self.waits[kind]]

    def plain(self, people: int, runs: Sequence[str], seconds: float) -> dict[str, Any]:
        """Return all figures as JSON has them; milliseconds where the name says so."""
        served = [self.answers[run] for run in runs]
        return {
            "people": people,
            "runs": len(runs),
            "seconds": round(seconds, 3),
            "answered": self.answered,
            "per_second": round(self.answered / seconds, 2) if seconds else 0.0,
            "least_of_a_run": min(served, default=0),
            "most_of_a_run": max(served, default=0),
            "skipped": self.skipped,
            "unneeded": self.unneeded,
            "episodes_ended": self.episodes,
            "next_question_ms": percentiles(self.all_waits()),
            **{f"next_{kind}_ms": percentiles(self.waits[kind]) for kind in KINDS},
            "answer_ms": percentiles(self.requests),
            "errors": dict(self.errors),
        }


def percentiles(seconds: Sequence[float]) -> dict[str, float] | None:
    """Return some percentiles and the most in milliseconds; None where nothing was measured."""
    if not seconds:
        return None
    cuts = quantiles([*seconds, *seconds], n=100, method="inclusive")  # two points at least
    found = {name: round(1000 * cuts[at], 1) for name, at in SHARES.items()}
    return {**found, "max": round(1000 * max(seconds), 1)}


def live_line(figures: Figures, people: int, seconds: float) -> str:
    """Return one line for while the crowd is at it."""
    lately = percentiles(figures.all_waits()[-1000:])
    wait = f", next question p50 {lately['p50']:.0f} ms, p99 {lately['p99']:.0f} ms" if lately else ""
    troubles = f", {counted(figures.errors.total(), 'request')} sent again" if figures.errors else ""
    rate = figures.answered / seconds if seconds else 0.0
    return f"{seconds:4.0f} s: {people} here, {figures.answered} answered, {rate:.1f}/s{wait}{troubles}"


def summary(plain: dict[str, Any]) -> str:
    """Return the figures as lines for people."""
    lines = [
        f"{plain['people']} people answered {plain['answered']} questions of {counted(plain['runs'], 'run')} "
        f"in {plain['seconds']:.0f} s: {plain['per_second']:.1f} a second, "
        f"{plain['least_of_a_run']} to {plain['most_of_a_run']} a run."
    ]
    named = {
        "next_guidance_ms": "next guidance",
        "next_preference_ms": "next preference",
        "answer_ms": "answer",
    }
    lines += [
        f"  {name:16}" + "".join(f"  {share} {number:8.1f} ms" for share, number in plain[key].items())
        for key, name in named.items()
        if plain[key] is not None
    ]
    other = {
        "skipped": "skipped",
        "unneeded": "no longer asked",
        "episodes_ended": "episodes ended",
    }
    lines += [f"  {plain[key]} {name}" for key, name in other.items() if plain[key]]
    lines += [f"  sent again {number} times: {sentence}" for sentence, number in plain["errors"].items()]
    return "\n".join(lines)
