"""An estimate of the time that pre-training takes (Sec. 3.1.4). No torch here.

The number of steps is known only once the policy has converged; the shipped weights of a world tell how many
it took at their size.
"""

from __future__ import annotations

from statistics import median

from parenting.weights.store import SHIPPED, SUFFIX, Wanted, metadata

MOST_SECONDS = 2 * 3600
"""Weights that are expected to take longer are made by `parenting pretrain` alone. A worker does one such
job at a time, and others wait for theirs."""
STEP_SECONDS = 2.4e-4
"""Seconds of a step for each cell of the board, measured: 2350 steps at 7 x 8 took 31 s on one of two cores
that others used as well."""


def seconds(wanted: Wanted) -> int:
    """Return the seconds that pre-training is expected to take, rounded up to ten."""
    expected = expected_steps(wanted) * wanted.height * wanted.width * STEP_SECONDS
    return 10 * int(-(-expected // 10))


def expected_steps(wanted: Wanted) -> int:
    """Return the number of steps after which pre-training is expected to converge.

    Steps are taken to grow as the number of cells does, from those of the world's shipped weights; a world
    without any is taken to need as many as most.
    """
    cells = wanted.height * wanted.width
    own = [(steps, size) for world, steps, size in _shipped() if world == wanted.world.name]
    shares = [steps / size for steps, size in own or [(steps, size) for _, steps, size in _shipped()]]
    return round(median(shares) * cells)


def _shipped() -> list[tuple[str, int, int]]:
    """World, steps and cells of each file of shipped weights."""
    found = []
    for path in sorted(SHIPPED.glob(f"*{SUFFIX}")):
        said = metadata(path.read_bytes())
        height, width = said["size"].split("x")
        world = path.name.removesuffix(SUFFIX).rsplit("-", 2)[0]
        found.append((world, int(said["steps"]), int(height) * int(width)))
    return found
