"""The random streams: SplitMix64 as published; uniform and independent along each of their coordinates."""

from __future__ import annotations

from math import exp, log

import pytest
import torch
from torch import Tensor

from parenting.envs import rng
from parenting.envs.rng import Stream, gumbel, keys

WORD = 2**64
GOLDEN = 0x9E3779B97F4A7C15

PUBLISHED = {
    0: [0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F, 0xF88BB8A8724C81EC, 0x1B39896A51A8749B],
    1234567: [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ],
}
"""The first outputs of SplitMix64 by seed: Vigna's splitmix64.c, and the test vector of Rosetta Code."""


def splitmix64(state: int) -> int:
    """One output of SplitMix64 whose state was `state`, written after Steele, Lea & Flood (2014)."""
    z = (state + GOLDEN) % WORD
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) % WORD
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) % WORD
    return z ^ (z >> 31)


def expected_draw(seed: int, trial: int, tick: int, stream: int, place: int) -> float:
    """A draw as the module's docstring has it, in Python's own integers: one hash for each word."""
    word = splitmix64((splitmix64(seed) + trial) % WORD)
    word = splitmix64((splitmix64((word + tick) % WORD) + stream) % WORD)
    return (splitmix64((word + place * GOLDEN) % WORD) >> 11) * 2.0**-53


def draws_along(coordinate: str, count: int) -> Tensor:
    """[count] draws of which one coordinate goes from 0 upwards and the others stand still."""
    index = torch.arange(count)
    if coordinate == "places":
        return keys(5, 1).at(Stream.WALKS, index)[0]
    if coordinate == "streams":
        one = keys(5, 1)
        return torch.cat([one.at(stream, torch.tensor([3]))[0] for stream in range(count)])
    if coordinate == "ticks":
        return keys(5, 1).pick(torch.zeros_like(index)).replace(tick=index).uniform(Stream.ACT)
    if coordinate == "trials":
        return keys(5, count).uniform(Stream.ACT)
    return torch.cat([keys(seed, 1).uniform(Stream.ACT) for seed in range(count)])


COORDINATES = {"places": 65536, "trials": 65536, "ticks": 65536, "streams": 4096, "seeds": 4096}


@pytest.mark.parametrize("seed", PUBLISHED)
def test_known_answers_of_splitmix64(seed: int) -> None:
    states = [(seed + number * GOLDEN) % WORD for number in range(5)]
    assert [splitmix64(state) for state in states] == PUBLISHED[seed]
    words = torch.tensor([rng._signed(state) for state in states])
    assert [word % WORD for word in rng._mix(words).tolist()] == PUBLISHED[seed]


@pytest.mark.parametrize("seed", [0, 7, 2**40])
def test_a_draw_is_a_hash_of_seed_trial_tick_stream_and_place(seed: int) -> None:
    now = keys(seed, 3).replace(tick=torch.tensor([0, 4, 90000]))
    for stream in (Stream.EITHER, Stream.ACT, Stream.TRAIN, Stream.WALKS, Stream.DRYING, Stream.WEIGHTS):
        drawn = now.uniform(stream, 2, 3).flatten(1)  # at once by place; the agent's small ones from a table
        few = now.uniform(stream, 4)
        for trial, tick in enumerate(now.tick.tolist()):
            answers = [expected_draw(seed, trial, tick, stream, place) for place in range(6)]
            assert drawn[trial].tolist() == answers
            assert few[trial].tolist() == answers[:4]


@pytest.mark.slow_after(3)
@pytest.mark.parametrize("coordinate", COORDINATES)
def test_chi_square_finds_the_draws_uniform(coordinate: str) -> None:
    """In 64 bins, four standard deviations of chi-square at most: for each coordinate the draws are fixed."""
    drawn = draws_along(coordinate, COORDINATES[coordinate])
    expected = len(drawn) / 64
    chi_square = float(((torch.histc(drawn, 64, 0, 1) - expected) ** 2 / expected).sum())
    assert abs(chi_square - 63) < 4 * (2 * 63) ** 0.5
    assert float(drawn.min()) >= 0
    assert float(drawn.max()) < 1


@pytest.mark.parametrize("coordinate", COORDINATES)
def test_neighbouring_draws_do_not_correlate(coordinate: str) -> None:
    drawn = draws_along(coordinate, COORDINATES[coordinate]) - 0.5
    for lag in range(1, 9):
        correlation = 12 * float((drawn[lag:] * drawn[:-lag]).mean())
        assert abs(correlation) * len(drawn) ** 0.5 < 4, f"at a distance of {lag}"


def test_no_draw_stands_at_two_coordinates() -> None:
    """Streams, ticks or trials that are shifts of one another would repeat their draws somewhere else."""
    now = keys(11, 16)
    drawn = []
    for _ in range(16):
        drawn += [now.at(stream, torch.arange(24)) for stream in Stream]
        now = now.next()
    drawn += [keys(seed, 16).at(stream, torch.arange(24)) for seed in (10, 12, 27) for stream in Stream]
    every = torch.cat(drawn).flatten()
    assert len(every) > 100_000
    assert len(set(every.tolist())) == len(every)


def test_streams_do_not_correlate_at_any_shift() -> None:
    """Every pair of streams, shifted against each other by up to eight places: five standard deviations."""
    count = 4096
    one = keys(3, 1)
    drawn = torch.cat([one.at(stream, torch.arange(count)) for stream in Stream]) - 0.5
    for shift in range(-8, 9):
        correlation = 12 * drawn @ drawn.roll(shift, dims=1).T / count
        if shift == 0:
            correlation.fill_diagonal_(0)
        assert float(correlation.abs().max()) * count**0.5 < 5, f"shifted by {shift}"


def test_gumbel_noise_has_the_gumbel_distribution() -> None:
    """P(noise <= x) = exp(-exp(-x)) at nine points, to four standard deviations; by hand at the ends."""
    count = 200_000
    noise = gumbel(keys(1, count).uniform(Stream.ACT))
    for x in (-1.5, -1, -0.5, 0, 0.5, 1, 2, 3, 4):
        chance = exp(-exp(-x))
        share = float((noise <= x).double().mean())
        assert abs(share - chance) < 4 * (chance * (1 - chance) / count) ** 0.5, f"at {x}"
    ends = gumbel(torch.tensor([0.0, exp(-1), 1 - 2.0**-53], dtype=torch.float64)).tolist()
    assert ends == pytest.approx([-log(53 * log(2)), 0, 53 * log(2)], abs=1e-12)
