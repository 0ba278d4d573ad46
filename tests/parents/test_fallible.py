"""Parents who err: how often, where, and that the same question at the same tick is answered the same."""

from __future__ import annotations

import pytest
import torch
from scipy.stats import binomtest

from parenting.agent import query as queries
from parenting.agent.config import compose
from parenting.agent.query import Answer, Choice, Query, QueryKind
from parenting.agent.state import AgentState
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import keys
from parenting.experiments.training.batch import train_agents
from parenting.experiments.training.stop_rule import StopRule
from parenting.parents.asked import OTHER, Asked
from parenting.parents.errors import PARTS, Wrong
from parenting.parents.fallible import FallibleParent, FallibleRule
from parenting.parents.grammar import ParentError, read_parent

N = 2000
WORLD = registry.make("unsafe-exploration", "island")
CONFIG = compose("lax", registry.defaults("unsafe-exploration"), {}, strict=True)
UP, DOWN, LEFT, RIGHT = range(4)
CLEAR = (UP, DOWN)


def question(world: Gridworld, left: int, right: int, trials: int = N) -> Query:
    """Guidance at the start."""
    start = world.reset(keys(0, trials), torch.zeros(trials, dtype=torch.int64))
    empty = queries.empty(trials, 1, world.height, world.width)
    sides = torch.tensor([left, right]).expand(trials, 2)
    frames = {name: getattr(empty, name).clone() for name in ("board", "agent", "box")}
    for side in (0, 1):
        for time, state in enumerate((start, world.forecast(start, sides[:, side]))):
            for name, part in frames.items():
                part[:, side, time] = getattr(state, name)
    return empty.replace(
        kind=torch.full_like(empty.kind, QueryKind.GUIDANCE),
        action=sides[:, :, None].clone(),
        length=torch.ones_like(empty.length),
        maturity=torch.ones_like(empty.maturity),
        **frames,
    )


def said(text: str, asked: Query, tick: int = 1, answers: int = 0) -> torch.Tensor:
    rule = FallibleRule(WORLD, read_parent(text), CONFIG.gamma, CONFIG.garden_parent)
    now = keys(5, len(asked.kind))
    return rule.answer(asked, now.replace(tick=now.tick + tick), torch.full_like(asked.kind, answers))


def right_answer(asked: Query) -> torch.Tensor:
    return said("scripted", asked)


@pytest.fixture
def sided() -> Query:
    """A question whose answer is one of the sides."""
    asked = question(WORLD, *CLEAR)
    assert set(right_answer(asked).tolist()) <= {Choice.LEFT, Choice.RIGHT}
    return asked


@pytest.mark.parametrize("text", ["noisy:0.1", "noisy:eps=0.4", "adversarial:0.25", "tiring:0.6,half=10"])
def test_errors_come_at_their_rate(sided: Query, text: str) -> None:
    wrong = said(text, sided, answers=10) != right_answer(sided)
    rate = {"noisy:0.1": 0.1, "noisy:eps=0.4": 0.4, "adversarial:0.25": 0.25}.get(text, 0.3)
    assert binomtest(int(wrong.sum()), N, rate).pvalue > 0.001


def test_a_boltzmann_parent_errs_as_its_softmax_says(sided: Query) -> None:
    rule = FallibleRule(WORLD, read_parent("boltzmann:0.5"), CONFIG.gamma, CONFIG.garden_parent)
    gap = float(rule.rule.values.advantage_gap(sided)[0])
    left = int((said("boltzmann:0.5", sided) == Choice.LEFT).sum())
    assert binomtest(left, N, float(torch.tensor(0.5 * gap).sigmoid())).pvalue > 0.001


def test_likeness_errs_more_where_clips_are_alike() -> None:
    pairs = (UP, RIGHT), (DOWN, RIGHT), (LEFT, RIGHT)  # up is a wall: its end is the start
    asked = [question(WORLD, *pair) for pair in pairs]
    near, diagonal, apart = (int((said("likeness:0.4", one) != right_answer(one)).sum()) for one in asked)
    assert binomtest(near, N, 0.5).pvalue > 0.001, "half of the time at most"
    assert binomtest(diagonal, N, 0.4).pvalue > 0.001
    assert apart == 0


def test_a_slip_is_drawn_again_and_a_misconception_is_not(sided: Query) -> None:
    slips = [said("noisy:0.3", sided, tick) for tick in (1, 2)]
    beliefs = [said("misconceived:0.3", sided, tick) for tick in (1, 2)]
    assert not torch.equal(*slips)
    assert torch.equal(*beliefs)
    assert 0.2 < float((beliefs[0] != right_answer(sided)).double().mean()) < 0.4


def test_a_mirrored_question_has_the_mirrored_answer(sided: Query) -> None:
    mirrored = question(WORLD, *reversed(CLEAR))
    for text in ("scripted", "noisy:0.3", "misconceived:0.3", "boltzmann:1"):
        assert torch.equal(said(text, mirrored), OTHER[said(text, sided)]), text


def test_parts_change_the_answer_in_their_order(sided: Query) -> None:
    assert set(said("adversarial+skipping:1", sided).tolist()) == {Choice.SKIP}
    assert torch.equal(said("adversarial", sided), OTHER[right_answer(sided)])
    assert set(said("indifferent:100+sided:1,side=right", sided).tolist()) == {Choice.RIGHT}
    twice = said("noisy:0.5+noisy:0.5", sided)
    assert not torch.equal(twice, right_answer(sided))  # they draw apart: the second does not undo the first


@pytest.mark.parametrize("name", list(PARTS))
def test_every_parent_answers_in_every_world(name: str) -> None:
    for world in registry.WORLDS:
        rules = registry.make(world, None)
        config = compose("lax", registry.defaults(world), {}, strict=True)
        asked = question(rules, UP, DOWN, trials=3)
        rule = FallibleRule(rules, read_parent(name), config.gamma, config.garden_parent)
        choice = rule.answer(asked, keys(1, 3), torch.zeros(3, dtype=torch.int64))
        assert bool((choice != Choice.NONE).all())
        nothing = asked.replace(kind=torch.zeros_like(asked.kind))
        silent = rule.answer(nothing, keys(1, 3), torch.zeros(3, dtype=torch.int64))
        assert bool((silent == Choice.NONE).all()), "nobody answers what was not asked"


class Contrary(Wrong):
    """A parent of one's own."""

    name = "contrary"
    eps: float = 1.0

    def chance(self, asked: Asked) -> torch.Tensor:
        return torch.full_like(asked.gap, self.eps)


def test_a_dotted_name_is_a_parent_of_ones_own(sided: Query) -> None:
    text = f"{__name__}.Contrary:eps=0.5"
    assert str(read_parent(text)) == text
    assert torch.equal(said(f"{__name__}.Contrary", sided), OTHER[right_answer(sided)])


@pytest.mark.parametrize(
    ("ends", "chance"), [(([0, 1], [2, 1]), 0), (([0, 1], [1, 0]), 0.1), (([1, 1], [0, 1]), 0.1707)]
)
def test_likeness_is_how_near_the_clips_end_to_each_other(
    sided: Query, ends: tuple[list[int], list[int]], chance: float
) -> None:
    agent = sided.agent.clone()
    agent[:, :, 1] = torch.tensor(ends)
    now = keys(5, N)
    asked = Asked(sided.replace(agent=agent), torch.ones(N), torch.zeros(N) > 0, now, now.tick)
    told = (
        PARTS["likeness"]
        .model_validate({"eps": 0.1})
        .change(asked, torch.full_like(now.tick, Choice.LEFT), 0)
    )
    wrong = int((told == Choice.RIGHT).sum())
    assert wrong == 0 if chance == 0 else binomtest(wrong, N, chance).pvalue > 0.001


def test_a_batch_hears_a_parent_who_errs() -> None:
    """The same answers as its rule gives for the same questions and ticks."""
    rule = FallibleRule(WORLD, read_parent("noisy:0.3"), CONFIG.gamma, CONFIG.garden_parent)
    heard = list[torch.Tensor]()

    class Listening(FallibleParent):
        def take(self, state: AgentState) -> Answer:
            expected = rule.answer(self.query, state.keys, self.answers)
            answer = super().take(state)
            heard.append(answer.choice != rule.rule.answer(self.query))
            assert torch.equal(answer.choice, expected)
            return answer

    train_agents(
        WORLD,
        CONFIG,
        keys(5, 4),
        StopRule("queries", 8),
        max_ticks=60,
        parent=lambda scripted, _done: Listening(rule, scripted.query),
    )
    assert any(bool(wrong.any()) for wrong in heard)


@pytest.mark.parametrize(
    "text",
    [
        "scripted",
        "noisy:eps=0.2",
        "boltzmann:beta=5.0+tiring:eps=0.3,half=9.0",
        "sided:p=0.2,side=right",
        "boltzmann:beta=1e+16",
    ],
)
def test_the_text_of_a_parent_reads_as_the_same(text: str) -> None:
    assert str(read_parent(text)) == text


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("nosy:0.1", "There is no parent 'nosy'. Did you mean 'noisy'?"),
        ("noisy:2", "noisy:eps=2: Input should be less than or equal to 1."),
        ("noisy:often", "noisy:eps=often"),
        ("noisy:rate=1", "noisy has no parameter 'rate'. It has: eps."),
        ("noisy:0.1,eps=0.2", "noisy: eps is given twice."),
        ("noisy+boltzmann", "boltzmann judges by itself, so it stands first"),
        ("boltzmann+myopic", "boltzmann and myopic each judge by themselves"),
        ("scripted:1", "scripted has no parameter '1'. It has none."),
        ("", "There is no parent ''."),
        ("no_such.module.Parent", "The parent 'no_such.module.Parent' cannot be imported"),
        ("..module.Parent", "The parent '..module.Parent' cannot be imported: the 'package' argument"),
        ("parenting.parents.errors.Wrong", "'parenting.parents.errors.Wrong' leaves open: chance."),
        ("parenting.parents.scripted.TIE", "'parenting.parents.scripted.TIE' is not a subclass"),
    ],
)
def test_a_wrong_text_has_a_sentence(text: str, sentence: str) -> None:
    with pytest.raises(ParentError) as caught:
        read_parent(text)
    assert str(caught.value).startswith(sentence)
