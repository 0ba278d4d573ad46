"""What is to be said about Fig. 2's numbers, from what was asked at this scale."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from parenting.agent.pretraining_mazes import EPISODES as WALKS
from parenting.evaluation.rollouts import EPISODES
from parenting.experiments.figure2.full_coverage import EPSILON
from parenting.experiments.figure2.rows import LIVED, MANY
from parenting.experiments.training.gardens import EPISODE, GAMMA

if TYPE_CHECKING:
    from parenting.experiments.figure2.settings import Arm, Baselines

ASKED = 1000
"""Queries at every T in the paper."""
SPREAD = "starts spread"
TERMS = {
    "batch": "`batch` is how many rows of X a gradient step takes; over all of X the last stages would take "
    "hours.",
    "gradient_steps": "`gradient_steps` is how many such steps a tick takes.",
    "own_length": "With `own_length` a policy learns from what was answered at its own T alone.",
    SPREAD: f"With *{SPREAD}* episodes of parenting begin anywhere on bare soil; what is measured begins at "
    "the start, as everywhere.",
}
"""What settings of lives mean."""
VERDICTS = (
    "+- is the deviation over the trials, as are the bars and the bands of the figure. The interval of a "
    "mean over trials is Student's, widened by the error of the weather that they share; that of a single "
    "policy is its error over the episodes. Where an interval holds what the number is compared with there "
    "is no *yes* and no *no*, nor is there for a single trial. The look-ahead agrees with our first table "
    "within three standard errors of the difference."
)
AHEAD = (
    "The look-ahead searches T moves on the reward, and then the parent's own value; it sees whether the "
    "plant under the agent has dried, which an agent does not."
)
COVERAGE = (
    "The coverage agent has the house's network, loss and clips, but asks about all six pairs of moves in "
    "every state that its own policy comes to in its episodes, and in those to which it comes where "
    f"{100 * EPSILON:.0f} % of the moves are random: clips put the frozen policies where they would not go "
    "themselves. Its X is by what it sees, where each state weighs the same. So what it lacks of the "
    "look-ahead is no want of queries."
)
GRADIENTS = (
    f"Policy gradients are REINFORCE on legitimate waterings (gamma {GAMMA}), {WALKS} episodes a step, "
    f"without a bucket. A baseline is subtracted: the mean return to go of the {WALKS} episodes at the same "
    "step."
)


def words(lives: Mapping[str, Arm], lines: Baselines) -> list[str]:
    """A paragraph each, on the lives and lines of a scale."""
    request = [_asked(lives), _settings(lives), *([_many(lives[MANY])] if MANY in lives else [])]
    return [_numbers(lines), VERDICTS, *request, AHEAD, COVERAGE, GRADIENTS]


def _numbers(lines: Baselines) -> str:
    return (
        f"Every number is a mean over episodes of {EPISODE} steps from the start, by argmax policies, and "
        "the weather of an episode is the same for all. Agents, and what learns from reward, are looked at "
        f"in {EPISODES} of them. The look-ahead walks {_some(lines.episodes)}. The coverage agent is "
        f"looked at in {_some(lines.budget.episodes)}, in which it has learnt, beside the look-ahead in the "
        f"same; and in {EPISODES} others, the fresh weather. *up-down* and *left* say where the parent walks "
        "inside its cycle."
    )


def _some(episodes: int) -> str:
    return "the same" if episodes == EPISODES else f"the first {episodes} of these"


def _asked(lives: Mapping[str, Arm]) -> str:
    every = lives[LIVED].every
    alike = "as the paper's do" if every == ASKED else f"where the paper's ask {ASKED}"
    others = f", but for *{MANY}*," if MANY in lives else ""
    begun = [f"*{name}*" for name, life in lives.items() if life.changes.get("pretrain")]
    return (
        f"Agents{others} ask {every} queries at every T, {alike}; what probabilities these had is not "
        f"legible in our copy. Those of *{LIVED}*, which are raised in all gardens, ask for guidance more "
        "often than the *conservative*, which come to know their garden and then hardly ask. The paper's may "
        f"have been pre-trained: here {' and '.join(begun) if begun else 'none'} is."
    )


def _settings(lives: Mapping[str, Arm]) -> str:
    """What the lives have beside the preset, and what that means."""
    alike = {name: life for name, life in lives.items() if name != MANY}
    each = "; ".join(f"*{name}* {_has(life)}, to T = {_last(life)}" for name, life in alike.items())
    used = {word for life in alike.values() for word in (*life.changes, *([SPREAD] if life.starts else []))}
    meant = [sentence for word, sentence in TERMS.items() if word in used]
    return " ".join([f"Beside the preset they have: {each}.", *meant])


def _has(life: Arm) -> str:
    said = [f"`{name}` {str(value).lower()}" for name, value in life.changes.items()]
    return ", ".join([*said, *([SPREAD] if life.starts else [])])


def _last(life: Arm) -> int:
    return -(-life.milestones[-1] // life.every)


def _many(life: Arm) -> str:
    """What the life of larger stages can tell, and what it cannot."""
    looks = [_number(queries) for queries in life.milestones if queries <= life.every]
    return (
        f"*{MANY}* is to tell the method from the size of its sample. Its looks at T = 1, after "
        f"{', '.join(looks[:-1])} and {looks[-1]} queries, differ in nothing but queries and the training "
        f"that goes on meanwhile: between them the sample alone grows. From the other lives it differs in "
        f"more ({_has(life)}), for else most of its life would be waiting for questions; so it is not to be "
        f"held against them by its queries alone. It is tried in one garden, with one parent, and ends at "
        f"{_number(life.milestones[-1])} queries, of which T = {_last(life)} has "
        f"{_number(life.milestones[-1] - life.every * (_last(life) - 1))}: what a large sample does there is "
        "not said."
    )


def _number(queries: int) -> str:
    return f"{queries:,}" if queries >= 10_000 else str(queries)
