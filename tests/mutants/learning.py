"""Faults in the policy, the loss and its gradients (Sec. 2.2, 2.3), in the agent and in the reference."""

from __future__ import annotations

from tests.mutants.mutant import Mutant

POLICY, EQUATIONS = "tests/agent/test_policy.py", "tests/agent/test_equations.py"
GUIDANCE, DATASET = "tests/agent/test_guidance.py", "tests/agent/test_dataset.py"
REFERENCE = "tests/agent/test_against_reference.py::test_same_query_log_and_parameters"

SAMPLING = [
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
        "[0, 1], [0.5, 0.5], [0, 0], [0, 0]]",
        "[0, 1], [1, 1], [0, 0], [0, 0]]",
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
        "weight * config.lambda_global",
        "weight * -config.lambda_global",
        f"{REFERENCE}[direct]",
    ),
    Mutant(
        "the entropy of the local head is penalised",
        "agent/learning.py",
        "weight * config.lambda_local",
        "weight * -config.lambda_local",
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
        "(query.kind != QueryKind.NONE) & answer.judges & (choice != Choice.NEITHER)",
        "(query.kind != QueryKind.NONE) & answer.judges",
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
