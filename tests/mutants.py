"""Mutants: small faults in what matters most, each with the test that must catch it.

`make mutants` tries them. A mutant replaces a text that stands once in a file. The tests named are about what
the mutant breaks, so that a fault is told by the test that a reader would look at.
"""

from __future__ import annotations

from typing import NamedTuple


class Mutant(NamedTuple):
    """One fault: in `file` the `text` becomes `replacement`, and `test` has to fail."""

    name: str
    file: str
    text: str
    replacement: str
    test: str


RNG, POLICY = "tests/envs/test_rng.py", "tests/agent/test_policy.py"
GUIDANCE, PAIRING = "tests/agent/test_guidance.py", "tests/agent/test_pairing.py"
MATURATION, EQUATIONS = "tests/agent/test_maturation.py", "tests/agent/test_equations.py"
REFERENCE = "tests/agent/test_against_reference.py::test_same_query_log_and_parameters"
SCRIPTED, DATASET = "tests/parents/test_scripted.py", "tests/agent/test_dataset.py"
ANSWERS, WORKER, RUNS = (
    "tests/server/test_answers.py",
    "tests/server/test_worker_side.py",
    "tests/server/test_runs.py",
)
SECURITY = "tests/server/test_security.py"

SAMPLING = [
    Mutant(
        "the agent no longer samples from its policy",
        "envs/rng.py",
        "return -(-(u.clamp_min(2.0**-53)).log()).log()",
        "return -(u.clamp_min(2.0**-53)).log()",
        f"{POLICY}::test_the_agents_moves_follow_softmax_of_its_own_logits",
    ),
    Mutant(
        "streams are shifts of one another",
        "envs/rng.py",
        "_mix(_mix(self._word + stream).unsqueeze(1) + place * _GOLDEN)",
        "_mix(self._word.unsqueeze(1) + (stream + place) * _GOLDEN)",
        f"{RNG}::test_streams_do_not_correlate_at_any_shift",
    ),
    Mutant(
        "trials are shifts of one another",
        "envs/rng.py",
        "return _mix(_mix(self.seed) + self.tick)",
        "return _mix(self.seed + self.tick)",
        f"{RNG}::test_no_draw_stands_at_two_coordinates",
    ),
    Mutant(
        "the hash is not SplitMix64's",
        "envs/rng.py",
        "(word ^ _shift(word, 27))",
        "(word ^ _shift(word, 28))",
        f"{RNG}::test_known_answers_of_splitmix64",
    ),
    Mutant(
        "draws are not uniform",
        "envs/rng.py",
        "_shift(bits, 11).to(torch.float64) * 2.0**-53",
        "(_shift(bits, 11).to(torch.float64) * 2.0**-53) ** 1.1",
        f"{RNG}::test_chi_square_finds_the_draws_uniform",
    ),
    Mutant(
        "an exploratory clip may begin with the best action (Eq. 4)",
        "agent/recording.py",
        "permitted = actions != best[:, None]",
        "permitted = actions >= 0 * best[:, None]",
        f"{POLICY}::test_exploratory_clips_begin_by_softmax_without_its_argmax",
    ),
    Mutant(
        "the reference no longer samples from its policy",
        "reference/policy.py",
        "return -log(-log(max(u, 2.0**-53)))",
        "return -log(max(u, 2.0**-53))",
        f"{REFERENCE}[direct]",
    ),
    Mutant(
        "weights begin twice as large",
        "agent/policy.py",
        "- 1) * bound",
        "- 1) * 2 * bound",
        f"{REFERENCE}[direct]",
    ),
]

LEARNING = [
    Mutant(
        "mu of *either* counts twice (Eq. 1)",
        "agent/query.py",
        "[0, 1], [0.5, 0.5], [0, 0]]",
        "[0, 1], [1, 1], [0, 0]]",
        f"{EQUATIONS}::test_eq_1_mu",
    ),
    Mutant(
        "mu of left and right are exchanged (Eq. 1)",
        "agent/query.py",
        "[[0, 0], [1, 0], [0, 1],",
        "[[0, 0], [0, 1], [1, 0],",
        f"{EQUATIONS}::test_eq_1_mu",
    ),
    Mutant(
        "the loss prefers what was not preferred (Eq. 2)",
        "agent/learning.py",
        "mu[..., 0] * F.softplus(-margin) + mu[..., 1] * F.softplus(margin)",
        "mu[..., 0] * F.softplus(margin) + mu[..., 1] * F.softplus(-margin)",
        f"{EQUATIONS}::test_eq_2_and_the_entropies",
    ),
    Mutant(
        "the entropy of the global head is penalised",
        "agent/learning.py",
        "- config.lambda_global * terms.entropy_global",
        "+ config.lambda_global * terms.entropy_global",
        f"{REFERENCE}[direct]",
    ),
    Mutant(
        "the entropy of the local head is penalised",
        "agent/learning.py",
        "- config.lambda_local * terms.entropy_local",
        "+ config.lambda_local * terms.entropy_local",
        f"{REFERENCE}[unsafe-exploration, scripted]",
    ),
    Mutant(
        "a question with its sides exchanged is learnt the wrong way round",
        "agent/dataset.py",
        "+= torch.where(turn, entry.mu.flip(1), entry.mu)",
        "+= entry.mu",
        f"{DATASET}::test_a_swapped_question_is_turned_round",
    ),
    Mutant(
        "*neither* is learnt from",
        "agent/guidance.py",
        "(query.kind != QueryKind.NONE) & (choice != Choice.NONE) & (choice != Choice.NEITHER)",
        "(query.kind != QueryKind.NONE) & (choice != Choice.NONE)",
        f"{GUIDANCE}::test_neither_redraws_the_other_two_in_the_same_tick_and_stores_nothing",
    ),
    Mutant(
        "the agent is trained although p_train says no",
        "agent/learning.py",
        "training = acted & coin & (state.x.rows > 0)",
        "training = acted & (state.x.rows > 0)",
        f"{REFERENCE}[seldom trained]",
    ),
]

ASKING = [
    Mutant(
        "familiarity counts one query too many (Sec. 2.1)",
        "agent/familiarity.py",
        "device=f.device), f)",
        "device=f.device), f + 1)",
        f"{GUIDANCE}::test_chance_by_hand",
    ),
    Mutant(
        "redrawn questions do not make a place familiar",
        "agent/guidance.py",
        "familiarity.count(state.familiarity, where, asking)",
        "familiarity.count(state.familiarity, where, pausing)",
        f"{REFERENCE}[unsafe-exploration, random]",
    ),
    Mutant(
        "refused actions are asked about again",
        "agent/guidance.py",
        ".masked_fill(state.refused, -torch.inf)",
        "",
        f"{GUIDANCE}::test_neither_redraws_the_other_two_in_the_same_tick_and_stores_nothing",
    ),
    Mutant(
        "the agent moves while it waits",
        "agent/recording.py",
        "moving = ~state.waiting\n",
        "moving = torch.ones_like(state.waiting)\n",
        f"{GUIDANCE}::test_nothing_moves_while_no_answer_comes",
    ),
    Mutant(
        "the agent asks where nobody supervises it (Sec. 3.2.5)",
        "agent/guidance.py",
        "undecided = view.supervised & ~state.waiting",
        "undecided = view.active & ~state.waiting",
        f"{REFERENCE}[absent-supervisor, scripted]",
    ),
    Mutant(
        "clips of other first states are compared (Sec. 2.2)",
        "agent/pairing.py",
        "ring.first[trial, other] == ring.first[trial, kind, later][:, None]",
        "ring.first[trial, other] == ring.first[trial, other]",
        f"{PAIRING}::test_search_finds_what_a_plain_search_finds",
    ),
    Mutant(
        "clips with the same first action are compared (Sec. 2.2)",
        "agent/pairing.py",
        "matches &= ring.action[trial, other, :, 0] != ring.action[trial, kind, later, 0][:, None]\n",
        "\n",
        f"{PAIRING}::test_search_finds_what_a_plain_search_finds",
    ),
    Mutant(
        "clips of two levels that look alike are compared",
        "agent/pairing.py",
        "matches &= ring.level[trial, other] == ring.level[trial, kind, later][:, None]",
        "matches &= ring.level[trial, other] >= 0",
        f"{REFERENCE}[levels that look alike]",
    ),
]

MATURING = [
    Mutant(
        "maturation freezes nothing (Sec. 2.4)",
        "agent/maturation.py",
        "frozen[maturity[trial] - 1, trial] = learner.params[trial]",
        "frozen[maturity[trial] - 1, trial] = 0",
        f"{MATURATION}::test_the_frozen_policy_stays_as_it_was",
    ),
    Mutant(
        "Adam goes on with the moments of the stage before",
        "agent/maturation.py",
        "exp_avg=learner.exp_avg.masked_fill(ripe[:, None], 0)",
        "exp_avg=learner.exp_avg",
        f"{MATURATION}::test_a_stage_ends",
    ),
    Mutant(
        "clips of the stage before are kept",
        "agent/maturation.py",
        "recorder=pairing.forget(state.recorder, ripe)",
        "recorder=state.recorder",
        f"{MATURATION}::test_a_stage_ends",
    ),
    Mutant(
        "the policies of a clip follow in the wrong order (Eq. 5, 6)",
        "agent/recording.py",
        "(state.maturity - state.recorder.step)[trial]",
        "(state.recorder.step)[trial]",
        f"{REFERENCE}[own length, guided]",
    ),
]

ANSWERING = [
    Mutant(
        "the scripted parent prefers the worse clip (Eq. 7)",
        "parents/scripted.py",
        "torch.where(gap > 0,",
        "torch.where(gap < 0,",
        f"{SCRIPTED}::test_greater_advantage_is_preferred",
    ),
    Mutant(
        "the scripted parent refuses where one move is safe",
        "parents/scripted.py",
        "unsafe(query).all(1)",
        "unsafe(query).any(1)",
        f"{SCRIPTED}::test_neither_exactly_when_both_moves_are_unsafe",
    ),
]

QUEUE = [
    Mutant(
        "a worker that slept past its claim may write (fencing)",
        "server/runs.py",
        "if (run.worker, run.fencing_token) != (mine.worker, mine.fencing_token):",
        "if run.worker is None:",
        f"{RUNS}::test_finish_is_fenced",
    ),
    Mutant(
        "a claim does not raise the fencing token",
        "server/runs.py",
        "run.fencing_token + 1, db.clock()",
        "run.fencing_token, db.clock()",
        f"{RUNS}::test_one_worker_a_run",
    ),
    Mutant(
        "a run is taken from a worker that lives",
        "server/runs.py",
        "Run.heartbeat < late",
        "Run.heartbeat <= db.clock()",
        f"{RUNS}::test_sign_of_life_keeps_the_claim",
    ),
    Mutant(
        "a lease never ends",
        "server/queue/leases.py",
        '_FREE = or_(Query.leased_until.is_(None), Query.leased_until <= bindparam("now"))',
        "_FREE = Query.leased_until.is_(None)",
        f"{ANSWERS}::test_leased_question_is_offered_again_when_its_lease_ends",
    ),
    Mutant(
        "two clients get the same question",
        "server/queue/leases.py",
        "or_(_MINE, _FREE))",
        "Query.id > 0)",
        f"{ANSWERS}::test_many_clients_lease_different_questions",
    ),
    Mutant(
        "anybody can let go of a lease",
        "server/queue/leases.py",
        "if query.leased_by == client_id:",
        "if query.leased_by is not None:",
        f"{ANSWERS}::test_release_offers_it_at_once_and_only_by_its_holder",
    ),
    Mutant(
        "an answer that is sent again is refused (idempotence)",
        "server/queue/answers.py",
        "if before is not None:\n            return _again(before, said)",
        'if before is not None:\n            raise Conflict("It was answered already.")',
        f"{ANSWERS}::test_same_answer_again_gets_the_same_reply",
    ),
    Mutant(
        "a second answer that differs is taken for the first",
        "server/queue/answers.py",
        "if before.choice != said.choice:",
        "if not before.choice:",
        f"{ANSWERS}::test_another_answer_is_refused",
    ),
    Mutant(
        "a replayed tick hears what comes next, not what was recorded",
        "server/queue/worker_side.py",
        "if _closed(session, mine.run_id, tick):",
        "if tick < 0:",
        f"{WORKER}::test_replay_gives_back_what_was_recorded",
    ),
    Mutant(
        "a replayed tick asks a second time",
        "server/queue/worker_side.py",
        "if known is not None:",
        "if known is not None and tick < 0:",
        f"{WORKER}::test_known_tick_is_not_asked_twice",
    ),
]

WEB = [
    Mutant(
        "another site may act (CSRF, by Sec-Fetch-Site)",
        "server/security.py",
        'in ("same-origin", "none")',
        'in ("same-origin", "same-site", "cross-site", "none")',
        f"{SECURITY}::test_other_sites_may_not",
    ),
    Mutant(
        "another site may act (CSRF, by Origin)",
        "server/security.py",
        'return None if origin.partition("://")[2] == host else Forbidden()',
        "return None",
        f"{SECURITY}::test_other_sites_may_not",
    ),
    Mutant(
        "any host name is served",
        "server/security.py",
        "if _without_port(host) not in self.hosts:",
        "if not host:",
        f"{SECURITY}::test_unknown_hosts_are_refused",
    ),
]

MUTANTS = [*SAMPLING, *LEARNING, *ASKING, *MATURING, *ANSWERING, *QUEUE, *WEB]
