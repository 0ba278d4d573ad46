"""Frugal asking for one trial, in plain Python: answers to guidance are remembered by state (ours).

docs/paper.md, "Frugal asking", says why. It shares with the agent the random keys, the config and the worlds,
and nothing else.
"""

from collections import Counter, defaultdict
from collections.abc import Callable
from itertools import permutations

import torch

from parenting.agent.config import Config
from parenting.envs.gridworld import Gridworld
from parenting.envs.rng import Stream
from reference.clips import Board, Clip, Entry, Query
from reference.parenting import ACTIONS, GUIDANCE, PREFERENCE, Reference
from reference.policy import distinct, loss

Pair = tuple[int, int]  # two actions, the lower first
Verdict = int | str  # the better action of a pair, or *either*, or *neither*


class Lessons:
    """The consequences of what guidance has answered in one state."""

    def __init__(self, answers: dict[Pair, Counter[Verdict]]) -> None:
        verdicts = {
            pair: verdict for pair, counts in answers.items() if (verdict := leading(counts)) is not None
        }
        chosen = {a for pair, v in verdicts.items() if v != "neither" for a in pair if v in (a, "either")}
        bad = {a for pair, v in verdicts.items() if v == "neither" for a in pair}
        self.approved, self.refused = chosen - bad, bad - chosen
        no_worse = {(a, a) for a in ACTIONS}
        strictly = set[Pair]()
        for (a, b), verdict in verdicts.items():
            if verdict == "either":
                no_worse |= {(a, b), (b, a)}
            elif isinstance(verdict, int):
                strictly.add((verdict, a + b - verdict))
        no_worse = reachable(no_worse | strictly)
        above = {
            (a, d) for b, c in strictly for a in ACTIONS for d in ACTIONS if {(a, b), (c, d)} <= no_worse
        }
        self.better = {(a, b) for a, b in above if (b, a) not in above}
        self.equal = {(a, b) for a, b in no_worse - above if a != b and (b, a) in no_worse - above}

    def compared(self, a: int, b: int) -> bool:
        """The order of two actions is known."""
        return bool({(a, b), (b, a)} & (self.better | self.equal))


def leading(counts: Counter[Verdict]) -> Verdict | None:
    """The verdict that was given most often, unless two were."""
    first, *rest = counts.most_common(2)
    return None if rest and rest[0][1] == first[1] else first[0]


def reachable(steps: set[Pair]) -> set[Pair]:
    """All pairs that chains of steps connect."""
    for b in ACTIONS:
        steps = steps | {(a, c) for a, x in steps for y, c in steps if x == y == b}
    return steps


class Frugal(Reference):
    """One trial that remembers guidance: all settings of *Frugal asking*, and `relabel`."""

    def __init__(
        self,
        world: Gridworld,
        config: Config,
        seed: int,
        trial: int,
        choose: Callable[[Clip, Clip, str], str],
    ) -> None:
        self.told: dict[tuple[Board, int], dict[Pair, Counter[Verdict]]] = defaultdict(
            lambda: defaultdict(Counter)
        )
        self.owing = False  # all gradient steps of a tick but the first
        self.reused = self.implied = self.late = self.relabelled = 0
        super().__init__(world, config, seed, trial, choose)

    def tick(self) -> None:
        """Sec. 2: one time step. Gradient steps that are owed are taken while the agent waits."""
        self.keys = self.keys.next()
        if self.state.terminated or self.world.truncated(self.state):
            self.state = self.world.reset(self.keys, (self.state.level + 1) % len(self.world.levels))
        approved = self.hear()
        if approved is None:
            approved = self.ask_or_reuse()
        if self.refused is None and self.act(approved):
            self.pair()
            self.train()
        self.grow()
        if self.refused is not None:
            self.pay()

    # ---- What guidance has told ----

    def hear(self) -> int | None:
        """Remember an answer to guidance before it moves the agent."""
        query = self.query
        self.heard_at = None if query is None or query.kind == PREFERENCE else query.left.start
        return super().hear()

    def resolve(self, choice: str, actions: tuple[int, int]) -> int | None:
        """Count the answer by state and pair; with `learn_refusals` the approved beat the refused."""
        state, stage = self.heard_at, self.stage_of(1)
        if state is not None and self.config.remembers and stage is not None:
            pair = min(actions), max(actions)
            verdict: Verdict = {"left": actions[0], "right": actions[1]}.get(choice, choice)
            self.told[state, stage][pair][verdict] += 1
            if self.config.learn_refusals:
                self.imply(state)
        return super().resolve(choice, actions)

    def stage_of(self, maturity: int) -> int | None:
        """The stage that an entry of this maturity trains: all, or its own; None where that has passed."""
        if not self.config.own_stage_only:
            return 0
        return maturity if maturity == self.stage else None

    def lessons(self, state: Board) -> Lessons:
        """All that guidance has told about a state, at this stage if each trains on its own entries."""
        stage = self.stage if self.config.own_stage_only else 0
        return Lessons(self.told.get((state, stage), {}))

    def imply(self, state: Board) -> None:
        """Add entries: approved better than refused, where X does not hold the pair."""
        known = self.lessons(state)
        held = {
            frozenset(e.actions) for e in self.X if e.state == state and self.stage_of(e.maturity) is not None
        }
        for pair in permutations(ACTIONS, 2):
            good, bad = pair[0] in known.approved, pair[1] in known.refused
            if good and bad and not known.compared(*pair) and frozenset(pair) not in held:
                self.X.append(Entry(state, pair, (1.0, 0.0), 1))
                self.implied += 1

    # ---- What is asked ----

    def ask_or_reuse(self) -> int | None:
        """Pause where the state is unfamiliar; ask, or return the move that earlier answers decide for."""
        l, p_guid = self.local(), self.config.p_guid
        if self.refused is None:
            unfamiliar = p_guid > 0 and self.u(Stream.ASK) < p_guid ** self.familiarity[l]
            if not unfamiliar or self.frozen or not self.supervised:
                return None
            self.refused = set()
            self.recording = None
        free = [a for a in ACTIONS if a not in self.refused]
        if not free:
            return None  # no acceptable action
        known = self.lessons(self.frame(self.state).observation)
        pair, move = self.candidates(free, known)
        if self.config.reuse_answers and move in known.approved and move in free:
            doubted = self.doubted(move, free) if self.config.relabel else None
            if doubted is None:
                self.refused = None
                self.reused += 1
                return move
            pair = doubted
            self.relabelled += 1
        left, right = pair if self.u(Stream.SIDES) < 0.5 else pair[::-1]
        self.familiarity[l] += 1
        self.post(Query(GUIDANCE, self.forecast(left), self.forecast(right), 1))
        return None

    def doubted(self, move: int, free: list[int]) -> Pair | None:
        """Return the pair whose leading answer is likeliest wrong, with that chance.

        It must hold the move, or be refused by *neither*. All votes on it count, and no opinion.
        """
        state, stage = self.frame(self.state).observation, self.stage if self.config.own_stage_only else 0
        e, worst = self.error_rate(), 0.0
        pair: Pair | None = None
        for candidate, counts in sorted(self.told.get((state, stage), {}).items()):
            votes, lead = counts.total(), max(counts.values())
            refused = all(counts[v] < counts["neither"] for v in (*candidate, "either"))
            if (move in candidate or refused) and set(candidate) <= set(free):
                each = (*sorted(counts.values(), reverse=True), 0, 0, 0)[:4]
                weights = [(1 - e) ** n * (e / 3) ** (votes - n) for n in each]
                wrong = 1 - (1 - e) ** lead * (e / 3) ** (votes - lead) / sum(weights)
                if wrong > worst:
                    worst, pair = wrong, candidate
        return pair if self.u(Stream.RELABEL) < worst else None

    def error_rate(self) -> float:
        """The parent's error rate before any repeat was heard."""
        return 0.1

    def candidates(self, free: list[int], known: Lessons) -> tuple[Pair, int | None]:
        """Return the pair to ask about, and the move that earlier answers decide for, if there is one."""
        avoided = known.refused if self.config.learn_refusals else set()
        noisy = self.noisy_logits(Stream.CANDIDATES)
        first, second = sorted(free, key=lambda a: (a in avoided, -noisy[a]))[:2]
        if not self.config.fresh_pairs:
            winner = second if (second, first) in known.better else first
            return (first, second), winner if known.compared(first, second) else None
        proposed = [a for a in free if a not in avoided]
        z = self.logits(self.pi)
        unbeaten = [a for a in proposed if not any((b, a) in known.better for b in proposed)]
        unbeaten.sort(key=lambda a: -z[a])
        best = next(iter(unbeaten), None)
        fresh = [a for a in unbeaten[1:] if best is not None and not known.compared(best, a)]
        if best is not None and fresh:
            return (best, fresh[0]), None
        return (first, second), best

    # ---- Gradient steps, the first at once and the others late ----

    def train(self) -> bool:
        """Take the gradient steps; with `late_steps` the first, after those that are still owed."""
        if not self.config.late_steps:
            return super().train()
        if not self.rows() or self.u(Stream.TRAIN) >= self.config.p_train:
            return False
        self.pay()
        self.descend(0)
        self.owing = self.config.gradient_steps > 1
        return True

    def pay(self) -> None:
        """Take the gradient steps that are owed."""
        if self.owing:
            self.late += 1
            for step in range(1, self.config.gradient_steps):
                self.descend(step)
        self.owing = False

    def descend(self, step: int) -> None:
        """Take one gradient step on the rows of X as they are now."""
        rows, lambdas = self.rows(), (self.config.lambda_global, self.config.lambda_local)
        noise = self.keys.at(Stream.BATCH, 65536 * step + torch.arange(len(rows)))[0].tolist()
        smallest = sorted(range(len(rows)), key=lambda r: noise[r])[: self.config.batch_size]
        self.adam.zero_grad()
        loss(self.pi, [rows[r] for r in smallest], *lambdas).backward()  # type: ignore[no-untyped-call]
        self.adam.step()

    def rows(self) -> list[tuple[Board, dict[int, float]]]:
        """The rows of X that train pi_T."""
        own = [e for e in self.X if e.maturity == self.stage or not self.config.own_stage_only]
        return distinct([entry[:3] for entry in own])

    def mature(self) -> None:
        """Freeze pi_T; steps that it still owed are not taken."""
        super().mature()
        self.owing = False
