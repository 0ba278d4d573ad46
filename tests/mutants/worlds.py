"""Faults in the random numbers that worlds and agents draw."""

from __future__ import annotations

from tests.mutants.mutant import Mutant

RNG, POLICY = "tests/envs/test_rng.py", "tests/agent/test_policy.py"

RANDOM = [
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
]
