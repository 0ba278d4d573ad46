"""What Fig. 2 comes to: findings, words and the drawing, from the rows alone."""

from __future__ import annotations

from collections.abc import Sequence
from math import log, sqrt
from statistics import fmean

from experiments.experiment import Asked, Report
from experiments.figure2_drawing import LIVED, draw, kinds, of
from experiments.findings import SILENT, Finding, Z, between, spread
from experiments.pieces import Row

FIRST = {
    "garden": (4.49, 5.16, 5.24, 5.35, 5.38, 5.35),
    "garden-mirrored": (4.26, 4.74, 4.66, 4.78, 5.32, 5.43),
}
"""What an earlier program of ours measured of the look-ahead, T = 1 to 6, under the first parent."""
FIRST_ERRORS = (0.05, 0.05, 0.05, 0.05, 0.1, 0.1)
NEAR = 0.95
"""Of the look-ahead's waterings: what counts as coming near."""
MANY = "10,000 a stage"


def report(asked: Asked, rows: Sequence[Row]) -> Report:
    """Everything beside the paper's."""
    findings = [
        *_lines(rows),
        *_aheads(rows),
        *_covers(rows),
        *_lives(rows),
        *_enough(rows),
    ]
    return Report(findings, WORDS, {"maturation": lambda figure: draw(figure, rows)})


# The lines


def _lines(rows: Sequence[Row]) -> list[Finding]:
    found = [
        Finding(
            f"{_where(row)}: the parent's own policy",
            "about 2",
            f"{row['waterings']:.2f}",
            note="exact",
        )
        for row in of(rows, "parent")
    ]
    gradients = of(rows, "policy gradients")
    last = max(row["steps"] for row in gradients)
    for level in dict.fromkeys(row["level"] for row in gradients):
        mine = [row for row in gradients if row["level"] == level]
        values = [row["waterings"] for row in mine if row["steps"] == last]
        before = fmean(row["waterings"] for row in mine if row["steps"] == _before(mine, last))
        note = f"best {max(values):.2f}; {before:.2f} at {_before(mine, last)} of {last} gradient steps"
        found.append(
            Finding(
                f"{level}: policy gradients without a bucket",
                "above 5",
                spread(values),
                interval=between(values),
                agrees=fmean(values) > 5,
                note=note,
            )
        )
    return found


def _before(rows: Sequence[Row], last: int) -> int:
    found: int = max(row["steps"] for row in rows if row["steps"] < last)
    return found


def _aheads(rows: Sequence[Row]) -> list[Finding]:
    found = []
    for row in of(rows, "look-ahead"):
        number, known = row["stage"], row["inside"] == "up-down"
        first = FIRST[row["level"]][number - 1] if known else None
        found.append(
            Finding(
                f"{_where(row)}: exact look-ahead, T = {number}",
                SILENT if first is None else f"{first} (our first table)",
                f"{row['waterings']:.2f}",
                difference="" if first is None else f"{row['waterings'] - first:+.2f}",
                interval=_around(row["waterings"], row["error"]),
                agrees=None if first is None else _same(row, first, FIRST_ERRORS[number - 1]),
                note=f"steps into the bucket: {row['bucket']}" if row["bucket"] else "",
            )
        )
    return found


def _same(row: Row, first: float, error: float) -> bool:
    """Within three standard errors of the difference."""
    return bool(abs(row["waterings"] - first) <= 3 * sqrt(row["error"] ** 2 + error**2))


def _covers(rows: Sequence[Row]) -> list[Finding]:
    """An agent without a want of queries, against the look-ahead in the same weather."""
    return [
        Finding(
            f"{_where(row)}: coverage agent, T = {row['stage']}",
            f"within 5 % of {row['ahead']:.2f} (look-ahead)",
            f"{row['waterings']:.2f}",
            difference=f"{100 * (row['waterings'] / row['ahead'] - 1):+.1f} %",
            interval=_around(row["waterings"], row["error"]),
            agrees=row["waterings"] >= NEAR * row["ahead"],
            note=f"X holds {row['known']} of the {row['reached']} states that it reaches, "
            f"after {row['questions']} questions in {row['states']} states; "
            f"{row['fresh']:.2f} in fresh weather; {row['bucket']} steps into the bucket",
        )
        for row in of(rows, "coverage")
    ]


# The lives


def _lives(rows: Sequence[Row]) -> list[Finding]:
    found = []
    for name, level, inside in kinds(rows):
        mine = [row for row in of(rows, name) if (row["level"], row["inside"]) == (level, inside)]
        for queries in dict.fromkeys(row["queries"] for row in mine):
            found.append(_stage(name, [row for row in mine if row["queries"] == queries], rows))
        if name == LIVED:
            found.append(_rise(mine))
    return found


def _stage(name: str, mine: Sequence[Row], rows: Sequence[Row]) -> Finding:
    """All trials at one milestone."""
    first, there = mine[0], [row for row in mine if row["there"]]
    values = [row["waterings"] for row in there]
    what = f"{_where(first)}: {name}, T = {first['stage']}, {first['queries']} queries in all"
    if not there:
        return Finding(what, SILENT, SILENT, note=f"0 of {len(mine)} trials came so far")
    parent, ahead = (_line(rows, line, first) for line in ("parent", "look-ahead"))
    bucket = sum(row["bucket"] for row in there)
    notes = [
        "" if ahead is None else f"{100 * fmean(values) / ahead:.0f} % of the look-ahead",
        f"{bucket} of {10_000 * len(there)} steps into the bucket",
        "" if len(there) == len(mine) else f"{len(there)} of {len(mine)} trials came so far",
    ]
    passes = first["stage"] == 1 and parent is not None and name in (LIVED, MANY)
    return Finding(
        what,
        "above its parent" if passes else SILENT,
        spread(values),
        difference="" if parent is None else f"{fmean(values) - parent:+.2f} on its parent",
        interval=between(values),
        agrees=fmean(values) > parent if passes and parent is not None else None,
        note="; ".join(filter(None, notes)),
    )


def _rise(mine: Sequence[Row]) -> Finding:
    """Does it rise with T? From T = 1 to the best later stage that the paper has, trial by trial."""
    stages = sorted({row["stage"] for row in mine if row["stage"] <= 4})
    first, last = (
        {row["trial"]: row["waterings"] for row in mine if row["stage"] == stage and row["there"]}
        for stage in (stages[0], stages[-1])
    )
    gains = [last[trial] - first[trial] for trial in last if trial in first]
    return Finding(
        f"{_where(mine[0])}: {LIVED}, what T = {stages[-1]} adds to T = {stages[0]}",
        "rises",
        spread(gains),
        interval=between(gains),
        agrees=fmean(gains) > 0 if gains else None,
    )


def _enough(rows: Sequence[Row]) -> list[Finding]:
    """How many queries at T = 1 would bring the learnt agent within 5 % of the look-ahead."""
    mine = [row for row in of(rows, MANY) if row["stage"] == 1 and row["there"]]
    if not mine:
        return []
    ahead = _line(rows, "look-ahead", mine[0])
    points = []
    for queries in dict.fromkeys(row["queries"] for row in mine):
        mean = fmean(row["waterings"] for row in mine if row["queries"] == queries)
        if ahead is not None:
            points.append((queries, 1 - mean / ahead))
    said = ", ".join(f"{100 * gap:.1f} % at {queries}" for queries, gap in points)
    return [
        Finding(
            f"{_where(mine[0])}: queries for 5 % of the look-ahead, T = 1",
            SILENT,
            extrapolated(points, 1 - NEAR),
            note=f"short of it: {said}; a straight line through the logarithms",
        )
    ]


def extrapolated(points: Sequence[tuple[int, float]], gap: float) -> str:
    """At how many queries a power law through (queries, gap) comes to a gap; in words where it does not."""
    done = [queries for queries, found in points if found <= gap]
    if done:
        return f"{min(done)} or fewer"
    if len(points) < 2:
        return "cannot be said of one number"
    x, y = [log(queries) for queries, _ in points], [log(found) for _, found in points]
    across = sum((one - fmean(x)) ** 2 for one in x)
    slope = sum((one - fmean(x)) * (other - fmean(y)) for one, other in zip(x, y, strict=True)) / across
    if slope >= 0:
        return "cannot be said: the gap does not close"
    exponent = fmean(x) + (log(gap) - fmean(y)) / slope
    return (
        f"about {10 ** round(exponent / log(10), 1):,.0f}" if exponent < log(1e9) else "more than a billion"
    )


# Rows


def _line(rows: Sequence[Row], name: str, like: Row) -> float | None:
    """What a line says where a row is: same garden, same parent, and for the look-ahead same T."""
    for row in of(rows, name):
        alike = (row["level"], row["inside"]) == (like["level"], like["inside"])
        if alike and (name == "parent" or row["stage"] == like["stage"]):
            found: float = row["waterings"]
            return found
    return None


def _where(row: Row) -> str:
    return f"{row['level']}, {row['inside']}"


def _around(mean: float, error: float) -> str:
    return f"{mean - Z * error:.2f} to {mean + Z * error:.2f}"


WORDS = (
    "Every number is a mean over 1000 episodes of 10 steps, argmax policies, with the same weather for all;"
    " +- is the deviation over the trials. *up-down* and *left* say where the parent walks inside its "
    "cycle.",
    "*Conservative* agents ask 1000 queries at every T, as the paper's do. Its probabilities are not "
    "legible in our copy, and it may have begun with a pre-trained agent: here only the life that says so "
    "does. A gradient step takes 32 rows of X, not all of them (`batch`): over all of X, T = 6 would take "
    "hours.",
    "*More guidance* is p_guid = 0.99. With *starts spread* its episodes of parenting begin anywhere on bare "
    "soil; what is measured begins at the start, as everywhere.",
    "*10,000 a stage* asks even more (0.999), for else most of its life would be waiting for questions; it "
    "always records and looks for pairs, trains in half of its ticks on 64 rows, and goes to T = 2 alone.",
    "The look-ahead searches T moves on the reward, and then the parent's own value; it sees whether the "
    "plant under the agent has dried, which an agent does not.",
    "The coverage agent has the house's network, loss and clips, but asks about all six pairs of moves in "
    "every state that its own policy comes to in its episodes, and in those to which a quarter of random "
    "moves leads: clips put the frozen policies where they would not go themselves. Its X is by what it "
    "sees, where each state weighs the same. So what it lacks of the look-ahead is no want of queries.",
    "Policy gradients are REINFORCE on legitimate waterings (gamma 0.9), 16 episodes a step, without a "
    "bucket. A baseline is subtracted: the mean return to go of the 16 episodes at the same step.",
)
