"""PARENTING for one trial, in plain Python: the executable specification. Newcomers start reading here.

`Reference.tick` is one time step; the methods below it stand in the order of the paper's sections. Section
and equation numbers are those of Frye & Feige, *Parenting* (2019); docs/paper.md decides what the paper
leaves open. The batched agent (`agent/`) must ask the same queries and learn the same parameters, to
rounding. The two share the uniform random draws, the config and the world, and nothing else. No reward is
read.
"""

from collections import Counter, deque
from collections.abc import Callable, Sequence
from copy import deepcopy

import torch
from torch import Tensor

from parenting.agent.config import Config
from parenting.envs.gridworld import Gridworld, WorldState
from parenting.envs.rng import Stream, keys
from reference.clips import Clip, Entry, Frame, Query, Recorded, board, same_moves, same_pair
from reference.policy import Policy, distinct, flat, gumbel, local_state, loss

ACTIONS = range(4)  # up, down, left, right
GUIDANCE, PREFERENCE = "guidance", "preference"  # the kinds of queries
EXPLOIT, EXPLORE = "exploit", "explore"  # the kinds of clips
MU = {"left": (1.0, 0.0), "right": (0.0, 1.0), "either": (0.5, 0.5)}  # Eq. (1); *neither* teaches nothing
RING = 4096  # a clip leaves the recorder when so many of its kind have come after it


class Reference:
    """One trial of one run. `tick` is one call of the batched `step`; `log` holds what it asked, in order.

    The parent, `choose`, is given the left clip, the right clip and the kind of query. It says *left*,
    *right*, *either* or *neither*. What one tick asks, the next one hears.
    """

    def __init__(
        self,
        world: Gridworld,
        config: Config,
        seed: int,
        trial: int,
        choose: Callable[[Clip, Clip, str], str],
    ) -> None:
        self.world, self.config, self.choose = world, config, choose
        self.keys = keys(seed, trial + 1).pick(torch.tensor([trial]))
        self.state = world.reset(self.keys, torch.tensor([0]))
        self.policies = [Policy(world, self.keys)]  # pi_1 .. pi_T
        self.X: list[Entry] = []
        self.familiarity: Counter[tuple[int, ...]] = Counter()  # f(l): guidance queries asked in l(s)
        self.compared: set[object] = set()  # all that was ever asked
        self.query: Query | None = None  # asked in the last tick, heard in this one
        self.refused: set[int] | None = None  # the actions refused in this pause; None when not paused
        self.recording: Clip | None  # half-recorded
        self.turn: str  # the kind of the next clip, or of the half-recorded one
        self.clips: dict[str, deque[Recorded | None]]  # the recorder
        self.log: list[tuple[int, str, Clip, Clip]] = []
        self.begin_stage()

    def tick(self) -> None:
        """Sec. 2: one time step, or a tick that only asks and waits."""
        self.keys = self.keys.next()
        if self.state.terminated or self.world.truncated(self.state):
            self.state = self.world.reset(self.keys, (self.state.level + 1) % len(self.world.levels))
        approved = self.hear()
        if approved is None:
            self.ask()
        if self.refused is None and self.act(approved):
            self.pair()
            self.train()
        self.grow()

    # ---- 2.1 Human guidance ----

    def hear(self) -> int | None:
        """Add the answer to the last query to X, and return the action that it approves, if any."""
        if self.query is None:
            return None
        (kind, left, right, maturity), self.query = self.query, None
        choice = self.choose(left, right, kind)
        actions = left.actions[0], right.actions[0]
        if kind == GUIDANCE or maturity == self.stage:
            self.answered += 1
        if choice != "neither":
            self.X.append(Entry(left.start, actions, MU[choice], maturity))
        return None if kind == PREFERENCE else self.resolve(choice, actions)

    def resolve(self, choice: str, actions: tuple[int, int]) -> int | None:
        """Return the action that an answer to guidance approves; *neither* refuses both."""
        if choice == "neither":  # still paused: `ask` draws again in this same tick
            self.refused = {*(self.refused or ()), *actions}
            return None
        self.refused = None
        if choice == "either":
            choice = "left" if self.u(Stream.EITHER) < 0.5 else "right"
        return actions[0] if choice == "left" else actions[1]

    def ask(self) -> None:
        """Pause where the state is unfamiliar, and ask which of two actions drawn from pi_T to take."""
        l, p_guid = self.local(), self.config.p_guid
        if self.refused is None:
            unfamiliar = p_guid > 0 and self.u(Stream.ASK) < p_guid ** self.familiarity[l]
            if not unfamiliar or self.frozen or not self.supervised:
                return
            self.refused = set()
            self.recording = None  # its actions would no longer be those of Eq. (3) to (6)
        remaining = [a for a in ACTIONS if a not in self.refused]
        if not remaining:
            return  # no acceptable action: paused until the operator ends the episode
        noisy = self.noisy_logits(Stream.CANDIDATES)
        first, second = sorted(remaining, key=lambda a: -noisy[a])[:2]
        left, right = (first, second) if self.u(Stream.SIDES) < 0.5 else (second, first)
        self.familiarity[l] += 1
        self.post(Query(GUIDANCE, self.forecast(left), self.forecast(right), 1))

    def post(self, query: Query) -> None:
        """Ask, and remember the pair and its first actions in this state at this stage."""
        kind, left, right, maturity = self.query = query
        self.log.append((int(self.keys.tick), kind, left, right))
        self.compared.add(self.known_pair(left, right, maturity))
        self.compared.add(same_moves(left.start, left.actions[0], right.actions[0], maturity))

    # ---- 2.2 Human preferences, about clips that are recorded as 2.4 has it ----

    def act(self, approved: int | None) -> bool:
        """Move, and return False if the agent is frozen: then the time step only ages the episode."""
        if self.frozen:
            self.state = self.world.step(self.state, torch.tensor([0]), self.keys)
            return False
        if not self.supervised:
            self.recording = None
        action = self.next_action(approved)
        self.state = self.world.step(self.state, torch.tensor([action]), self.keys)
        if self.recording is not None:
            self.record(self.recording, action)
        return True

    def next_action(self, approved: int | None) -> int:
        """Return the approved action, that of a recording, which may begin here, or one drawn from pi_T."""
        if approved is not None:
            return approved
        if self.recording is not None:  # Eq. (5), (6): a_t = argmax pi_{T-t}
            t = len(self.recording.actions)
            return argmax(self.logits(self.policies[self.stage - t - 1]))
        room = self.world.time_limit - int(self.state.step_count) >= self.stage
        if self.supervised and room and self.u(Stream.RECORD) < self.config.p_rec:
            action = self.explore() if self.turn == EXPLORE else argmax(self.logits(self.pi))  # Eq. (3), (5)
            if action is not None:
                self.recording = Clip(int(self.state.level), (self.frame(self.state),), ())
                return action
        return argmax(self.noisy_logits(Stream.ACT))

    def explore(self) -> int | None:
        """Eq. (4), (6): a_0 ~ pi_T, neither its argmax nor compared with that here at this stage."""
        s, best = self.frame(self.state).observation, argmax(self.logits(self.pi))
        permitted = [a for a in ACTIONS if a != best and self.is_new(same_moves(s, a, best, self.stage))]
        noisy = self.noisy_logits(Stream.EXPLORE)
        return max(permitted, key=lambda a: noisy[a], default=None)

    def record(self, begun: Clip, action: int) -> None:
        """Add a step to the clip. Death, goal or freezing ends it early; it is kept."""
        clip = Clip(begun.level, (*begun.frames, self.frame(self.state)), (*begun.actions, action))
        if len(clip.actions) < self.stage and not self.state.terminated and not self.frozen:
            self.recording = clip
            return
        self.clips[self.turn].append(Recorded(int(self.keys.tick), clip))
        self.recording = None
        self.turn = EXPLORE if self.turn == EXPLOIT else EXPLOIT

    def pair(self) -> None:
        """Ask about the newest clips, one of each kind, that begin in one state with different actions."""
        if not self.supervised or self.u(Stream.PREFER) >= self.config.p_pref:
            return
        exploit, explore = self.clips[EXPLOIT], self.clips[EXPLORE]
        pairs = [(e, x) for e in exploit if e for x in explore if x and self.match(e.clip, x.clip)]
        if not pairs:
            return
        # The tick that completed the later clip decides, then that of the earlier.
        e, x = max(pairs, key=lambda pair: sorted((clip.tick for clip in pair), reverse=True))
        exploit[exploit.index(e)] = explore[explore.index(x)] = None  # their places stay empty
        left, right = (e, x) if self.u(Stream.PAIR_SIDES) < 0.5 else (x, e)
        self.post(Query(PREFERENCE, left.clip, right.clip, self.stage))

    def match(self, e: Clip, x: Clip) -> bool:
        """Return True if the clips may be compared. Levels may look alike, and a query has one level."""
        alike = (e.start, e.level) == (x.start, x.level) and e.actions[0] != x.actions[0]
        return alike and self.is_new(self.known_pair(e, x, self.stage))

    def known_pair(self, left: Clip, right: Clip, maturity: int) -> object:
        """Return the key of a pair; it includes the stage if each stage trains only on its own entries."""
        return same_pair(left, right), maturity if self.config.own_stage_only else None

    # ---- 2.3 Direct policy learning ----

    def train(self) -> bool:
        """Take gradient steps of pi_T on X, and return True if there were any."""
        entries = [e for e in self.X if e.maturity == self.stage or not self.config.own_stage_only]
        if not entries or self.u(Stream.TRAIN) >= self.config.p_train:
            return False
        rows = distinct([entry[:3] for entry in entries])
        lambdas = self.config.lambda_global, self.config.lambda_local
        for g in range(self.config.gradient_steps):
            noise = self.keys.at(Stream.BATCH, 65536 * g + torch.arange(len(rows)))[0].tolist()
            smallest = sorted(range(len(rows)), key=lambda r: noise[r])[: self.config.batch_size]
            self.adam.zero_grad()
            loss(self.pi, [rows[r] for r in smallest], *lambdas).backward()  # type: ignore[no-untyped-call]
            self.adam.step()
        return True

    # ---- 2.4 Maturation ----

    def grow(self) -> None:
        """End the stage after enough answers; the last stage never ends."""
        every = self.config.queries_per_stage
        if every is not None and self.answered >= every and self.stage < self.config.max_clip_length:
            self.mature()

    def mature(self) -> None:
        """Freeze pi_T, and start pi_{T+1} as its copy."""
        self.policies.append(deepcopy(self.pi))
        self.begin_stage()

    def begin_stage(self) -> None:
        """An empty recorder, no answers yet, and a new Adam, for pi_T alone."""
        self.clips = {EXPLOIT: deque(maxlen=RING), EXPLORE: deque(maxlen=RING)}
        self.turn, self.recording, self.answered = EXPLOIT, None, 0
        self.adam = torch.optim.Adam(self.pi.parameters(), lr=self.config.learning_rate)

    @property
    def stage(self) -> int:
        """T: the length of the clips, and the number of the policy that trains."""
        return len(self.policies)

    @property
    def pi(self) -> Policy:
        """The policy pi_T, from which the agent acts."""
        return self.policies[-1]

    def parameters(self) -> list[list[Tensor]]:
        """Of each policy pi_1 .. pi_T the weights [fan in, out] and biases [out], layer by layer."""
        return [[flat(p) if p.dim() > 1 else p for p in pi.parameters()] for pi in self.policies]

    # ---- This moment ----

    @property
    def frozen(self) -> bool:
        """Held until the episode ends (3.2.4)."""
        return bool(self.world.frozen(self.state))

    @property
    def supervised(self) -> bool:
        """Supervised by the parent; otherwise nothing is asked or recorded (3.2.5)."""
        return bool(self.world.supervised(self.state))

    def frame(self, state: WorldState) -> Frame:
        """A state as clips hold it."""
        seen = self.world.observe(state.board, state.agent, state.box)
        cells = tuple(state.agent[0].tolist()), tuple(state.box[0].tolist())
        return Frame(board(seen), board(state.board), *cells)

    def forecast(self, action: int) -> Clip:
        """The clip of a guidance query: one move, without chance."""
        after = self.world.forecast(self.state, torch.tensor([action]))
        return Clip(int(self.state.level), (self.frame(self.state), self.frame(after)), (action,))

    def local(self) -> tuple[int, ...]:
        """l(s): the four cells that the agent can reach in its next step, as observed."""
        now = self.frame(self.state)
        return local_state(now.observation, now.agent)

    def logits(self, policy: Policy) -> list[float]:
        """A policy's logits here: the mean of its two heads (3.1.1)."""
        with torch.no_grad():
            near, far = policy.heads([self.frame(self.state).observation])
        logits: list[float] = ((near + far) / 2)[0].tolist()
        return logits

    def noisy_logits(self, stream: Stream) -> list[float]:
        """The argmax of these is an action drawn from pi_T; the two largest are two distinct ones."""
        draws = self.keys.uniform(stream, 4)[0].tolist()
        return [z + gumbel(u) for z, u in zip(self.logits(self.pi), draws, strict=True)]

    def u(self, stream: Stream) -> float:
        """This tick's draw from a stream, uniform on [0, 1)."""
        return float(self.keys.uniform(stream))

    def is_new(self, comparison: object) -> bool:
        """Not asked before, or `repeat_queries` is set, as in the paper as written."""
        return self.config.repeat_queries or comparison not in self.compared


def argmax(values: Sequence[float]) -> int:
    """The action of the greatest value; of equals the first."""
    return max(ACTIONS, key=lambda a: values[a])
