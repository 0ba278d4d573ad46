"""The episodes of a run as a dataset of Minari, for programs of offline reinforcement learning.

Observations, actions, rewards and `info` are those of the Gymnasium adapter (`envs.gym`), so a dataset names
its environment. The rewards are the safety suite's own: the agent that made the moves has read none of them.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from parenting._plural import counted
from parenting.agent.config import Config
from parenting.agent.init import world_of
from parenting.envs import registry
from parenting.envs.gridworld import Gridworld
from parenting.server import moves
from parenting.server.archive.manifest import RunEntry
from parenting.server.archive.minari_episodes import about, buffer
from parenting.server.archive.runs import settings_of
from parenting.server.archive.source import source
from parenting.server.archive.target import folder_target
from parenting.server.damage import damage
from parenting.server.db import Database
from parenting.server.errors import NotFound, SetupError
from parenting.server.runs import find

if TYPE_CHECKING:
    from minari import MinariDataset

REMEDY = "pip install 'parenting[minari]'"
Progress = Callable[[int, int], None]


class LivedRun(NamedTuple):
    """A run, as far as its episodes follow from it."""

    number: int
    settings: dict[str, Any]
    moves: bytes


class Dataset(NamedTuple):
    """A dataset that was written."""

    folder: Path
    episodes: int
    steps: int
    left_out: int  # episodes of which a tick is not known


def to_minari(export: str | Path, dataset_id: str, *, run: int | str | None = None) -> MinariDataset:
    """Write the episodes of an exported run as a dataset of Minari, among its other local datasets.

    Each step has the bits that the agent observed [H, W, O], its action, the suite's reward, and in `infos`
    `hidden_reward`, `cost` (1.0 for an unsafe step) and `tick`. Ticks in which the agent waited for guidance
    are not steps. The metadata of an episode tell its ticks, its pauses and its end. An episode whose ticks
    are not all known is left out; one that the operator or the end of the record cut off is truncated there.

    Args:
        export: The folder or zip that `parenting export RUN --out` has written.
        dataset_id: The name of the new dataset, such as "parenting/island/child-v0".
        run: The run's number or public id in the export; None takes the only one.

    Returns:
        The dataset, as `minari.load_dataset(dataset_id)` returns it.

    Raises:
        NotFound: The export has no such run, or several, or no step of it is recorded.
        SetupError: Minari is not installed, it is not an export, or the dataset exists.
    """
    minari = _minari()
    with source(Path(export)) as found:
        entry = _chosen(found.manifest.runs, run)
        blob = b"" if entry.moves is None else found.blob(entry.moves)
        if entry.moves and hashlib.sha256(blob).hexdigest() != found.manifest.files[entry.moves].sha256:
            raise SetupError(f"{export}: {entry.moves} is damaged. Take another copy of the export.")
    written = write_minari(LivedRun(entry.number, entry.settings, blob), dataset_id)
    return minari.MinariDataset(written.folder / "data")


def write_minari(lived: LivedRun, dataset_id: str, progress: Progress = lambda done, total: None) -> Dataset:
    """Write the episodes of a run, one after another, so that one at a time is in memory.

    Raises:
        NotFound: no step of it is recorded.
        SetupError: Minari is not installed, the name is none of Minari's, or the dataset exists.
    """
    minari = _minari()
    world = _world(lived)
    folder = _place(minari, dataset_id)
    all_ = moves.episodes(lived.moves)
    whole = [one for one in all_ if one.whole and one.steps]
    if not whole:
        raise NotFound(f"No episode of run {lived.number} is recorded as a whole, so there is no dataset.")
    with folder_target(folder) as part:
        storage = minari.dataset.minari_storage.MinariStorage.new(
            part / "data", *_spaces(world), env_spec=_spec(lived), data_format="parquet"
        )
        storage.update_metadata(_about(minari, lived, dataset_id))
        storage.update_episodes(_buffers(world, lived, whole, progress))
        storage.update_episode_metadata(map(about, whole))
    left_out = sum(not one.whole for one in all_)
    return Dataset(folder, len(whole), sum(one.steps for one in whole), left_out)


def lived_run(db: Database, run_id: int) -> LivedRun:
    """Return a run of the database.

    Raises:
        NotFound: there is no such run.
        SetupError: its row is damaged.
    """
    with db.read() as session:
        run = find(session, run_id)
        wrong = damage(run)
        if wrong is not None:
            raise SetupError(f"Run {run_id} cannot be read: {wrong}.")
        return LivedRun(run_id, settings_of(run), moves.moves_in(session, run_id))


def _buffers(
    world: Gridworld, lived: LivedRun, whole: list[moves.Episode], progress: Progress
) -> Iterator[Any]:
    for place, one in enumerate(whole):
        yield buffer(world, int(lived.settings["seed"]), lived.moves, place, one)
        progress(place + 1, len(whole))


def _minari() -> Any:
    try:
        import minari
        import minari.dataset.minari_storage
        import pyarrow  # noqa: F401
    except ImportError:
        raise SetupError(f"Datasets of Minari need minari and pyarrow: {REMEDY}") from None
    return minari


def _chosen(runs: list[RunEntry], wanted: int | str | None) -> RunEntry:
    found = [one for one in runs if wanted is None or wanted in (one.number, one.run)]
    if len(found) != 1:
        there = ", ".join(str(one.number) for one in runs)
        raise NotFound(f"Name one run of the export: it has {counted(len(runs), 'run')}: {there}.")
    return found[0]


def _place(minari: Any, dataset_id: str) -> Path:
    """Return the folder of a new dataset, and make its namespace."""
    from minari import namespace
    from minari.dataset.minari_dataset import parse_dataset_id
    from minari.storage import get_dataset_path

    try:
        space, *_ = parse_dataset_id(dataset_id)
        if space is not None and space not in namespace.list_local_namespaces():
            namespace.create_namespace(space)
    except ValueError as error:
        raise SetupError(f"{dataset_id} cannot be the name of a dataset of Minari: {error}") from None
    folder = Path(get_dataset_path(dataset_id))
    if folder.exists():
        raise SetupError(f"There is a dataset {dataset_id} already. Choose another name, or delete it.")
    return folder


def _world(lived: LivedRun) -> Gridworld:
    name, text = str(lived.settings.get("world")), str(lived.settings.get("level_text"))
    if not registry.knows(name, text):
        raise SetupError(f"Run {lived.number} is of the world {name}, which is not installed here.")
    return world_of(name, text, Config.model_validate(lived.settings["config"]))


def _spec(lived: LivedRun) -> Any:
    """Return Gymnasium's specification of the run's environment, by which others make it."""
    import gymnasium

    from parenting.envs.gym import gym_id

    world, text = lived.settings["world"], lived.settings["level_text"]
    config = Config.model_validate(lived.settings["config"])
    options: dict[str, Any] = {"level": text, "time_limit": config.max_episode_steps}
    if "supervised" in registry.spec(world, text).options:
        options["supervised"] = config.supervised
    return gymnasium.make(f"parenting:{gym_id(world)}", **options).spec


def _spaces(world: Gridworld) -> tuple[Any, Any]:
    from gymnasium import spaces

    shape = (world.height, world.width, len(world.legend))
    return spaces.MultiBinary(shape), spaces.Discrete(4)


def _about(minari: Any, lived: LivedRun, dataset_id: str) -> dict[str, Any]:
    told = lived.settings
    return {
        "dataset_id": dataset_id,
        "algorithm_name": "PARENTING",
        "description": (
            f"The life of an agent that learns from a parent's answers, in {told['world']}, level "
            f"{told.get('level')}, seed {told['seed']}. It has read no reward."
        ),
        "minari_version": minari.__version__,
    }
