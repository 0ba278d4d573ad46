"""Faults in what the agent asks (Sec. 2.1, 2.2), in its maturation (Sec. 2.4) and in the scripted parent."""

from __future__ import annotations

from tests.mutants.mutant import Mutant

GUIDANCE, PAIRING = "tests/agent/test_guidance.py", "tests/agent/test_pairing.py"
MATURATION, SCRIPTED = "tests/agent/test_maturation.py", "tests/parents/test_scripted.py"
REFERENCE = "tests/agent/test_against_reference.py::test_same_query_log_and_parameters"

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
        "    new = asking\n",
        "    new = pausing\n",
        f"{REFERENCE}[unsafe-exploration, random]",
    ),
    Mutant(
        "refused actions are asked about again",
        "agent/candidates.py",
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
        "(ring.first[trial, other] == first)",
        "(ring.first[trial, other] == ring.first[trial, other])",
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
