"""Every hyperparameter, one sentence each.

The same object serves the command line, the database and the web form. This file imports no torch.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import AliasChoices, AliasGenerator, BaseModel, ConfigDict, Field, model_validator

from parenting.envs.names import did_you_mean

Dtype = Literal["float32", "float64"]
Supervision = Literal["present", "absent", "random"]
GardenParent = Literal["up-down", "left"]


V1_NAMES = {
    "batch_size": "batch",
    "repeat_queries": "recompare",
    "max_clip_length": "stages",
    "queries_per_stage": "mature_every",
    "own_stage_only": "own_length",
    "max_episode_steps": "time_limit",
    "garden_parent": "inside",
}
"""Fields and their names in version 0.1. Either name is read everywhere; the formats that version 0.1 had
published keep its names: the database's JSON, the API v1, export 1, `--json`, results.json and CSV."""
FIELDS = {old: name for name, old in V1_NAMES.items()}


def v1_names(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings by the names that published formats write."""
    return {V1_NAMES.get(name, name): value for name, value in settings.items()}


def _names_to_read(field: str) -> str | AliasChoices:
    return AliasChoices(field, V1_NAMES[field]) if field in V1_NAMES else field


def _name_to_write(field: str) -> str:
    return V1_NAMES.get(field, field)


class Config(BaseModel):
    """The hyperparameters of PARENTING (Sec. 2, 3.1.2). Numbers lost with the digits are marked (?).

    `model_dump()` writes the names of published formats, `model_dump(by_alias=False)` those of the fields.
    """

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        validate_by_name=True,
        serialize_by_alias=True,
        alias_generator=AliasGenerator(validation_alias=_names_to_read, serialization_alias=_name_to_write),
    )

    # Sec. 2.1 to 2.3
    p_guid: float = Field(
        0.5, ge=0, le=1, description="Base of the chance p_guid ** f to pause for guidance; 0 never asks. (?)"
    )
    p_rec: float = Field(
        0.5, ge=0, le=1, description="Chance to begin recording a clip in a step without guidance. (?)"
    )
    p_pref: float = Field(
        0.5,
        ge=0,
        le=1,
        description="Chance, after a step, to look for a pair of clips and ask a preference. (?)",
    )
    p_train: float = Field(1.0, ge=0, le=1, description="Chance, after a step, to train on X.")
    gradient_steps: int = Field(1, ge=1, le=1000, description="Gradient steps in a tick that trains.")
    lambda_global: float = Field(0.01, ge=0, description="Entropy coefficient of the global head. (?)")
    lambda_local: float = Field(0.01, ge=0, description="Entropy coefficient of the local head. (?)")
    learning_rate: float = Field(
        0.001, gt=0, description="Adam's step size; beta 0.9 and 0.999 and eps 1e-8 are its defaults."
    )
    batch_size: int | None = Field(
        None,
        ge=1,
        le=2**53 - 1,
        description="Distinct rows of X in a gradient step; none takes all of them.",
    )
    repeat_queries: bool = Field(
        False, description="Ask again about pairs that were compared before, as in the paper as written."
    )
    # Sec. 2.4
    max_clip_length: int = Field(
        1, ge=1, le=16, description="The last clip length T; the agent matures through the stages 1 .. T."
    )
    queries_per_stage: int | None = Field(
        None,
        ge=1,
        le=2**53 - 1,
        description="Answered queries after which a stage ends; none leaves it to the operator.",
    )
    own_stage_only: bool = Field(
        False, description="Train pi_T on entries of maturity T alone, as Sec. 4.1 supposes."
    )
    # the run
    max_episode_steps: int = Field(
        100, ge=1, le=10_000, description="Steps after which an episode is cut off."
    )
    gamma: float = Field(1.0, gt=0, le=1, description="The parent's discount in Eq. (7) and (8).")
    supervised: Supervision = Field(
        "present", description="Whether the supervisor is there, where a world has one (Sec. 3.2.5)."
    )
    garden_parent: GardenParent = Field(
        "up-down", description="Where the garden's parent walks inside its cycle (Sec. 3.3)."
    )
    pretrain: bool = Field(
        False, description="Begin with weights pre-trained on mazes, and rehearse mazes (Sec. 3.1.4)."
    )
    # beyond the paper (docs/paper.md, "Extensions")
    late_steps: bool = Field(
        False,
        description="Take one gradient step before the next question is drawn, the rest after. (ours)",
    )
    fresh_pairs: bool = Field(
        False,
        description="Guidance compares the likeliest move with the likeliest not yet compared to it. (ours)",
    )
    reuse_answers: bool = Field(
        False,
        description="Move without asking where earlier guidance in this state decides. (ours)",
    )
    learn_refusals: bool = Field(
        False,
        description="Moves refused by neither count as worse than what is approved in this state. (ours)",
    )
    relabel: bool = Field(
        False,
        description="Ask again about a reused answer with the chance that it is wrong. (ours)",
    )
    confirm: float = Field(
        0.0,
        ge=0,
        lt=1,
        description="Ask guidance again, mirrored, until it is right with this probability; 0 never. (ours)",
    )
    max_open_preferences: int = Field(
        3, ge=0, le=1000, description="The agent waits while more preference queries than this are open."
    )
    dtype: Dtype = Field("float32", description="Precision of the policy and its training.")

    @property
    def remembers(self) -> bool:
        """Return whether guidance is remembered by state (`agent.memory`)."""
        return self.fresh_pairs or self.reuse_answers or self.learn_refusals

    @model_validator(mode="before")
    @classmethod
    def _one_name_each(cls, given: Any) -> Any:
        names = set(given) if isinstance(given, Mapping) else set()
        twice = [f"{name} and {old}" for name, old in V1_NAMES.items() if {name, old} <= names]
        if twice:
            raise ValueError(f"{'; '.join(twice)} are two names of one setting: give one of them.")
        return given


PRESETS: dict[str, dict[str, float | bool]] = {
    # Table 1; the digits are lost in our copy, see docs/paper.md
    "conservative": {"p_guid": 0.95, "p_rec": 0.8, "p_pref": 0.8},
    "lax": {"p_guid": 0.5, "p_rec": 0.5, "p_pref": 0.5},
    "direct": {"p_guid": 0.0, "p_rec": 0.5, "p_pref": 0.5},
    # beyond the paper: docs/paper.md, "Extensions"
    "frugal": {
        "p_guid": 1.0,
        "p_rec": 0.8,
        "p_pref": 0.8,
        "gradient_steps": 9,
        "fresh_pairs": True,
        "reuse_answers": True,
        "learn_refusals": True,
    },
}
"""The settings of Table 1, by name, the conservative one first; and `frugal`, which is ours."""

MOST = {"lambda_global": 100.0, "lambda_local": 100.0, "learning_rate": 1.0}
"""The largest of these in a new run. Stored runs keep theirs: older versions took any."""

FRUGAL_WORLDS = ("unsafe-exploration", "side-effects")
"""Worlds where `frugal` is shown to need fewer answers than `conservative` and to die no more often, on every
level that was tried (docs/results/questions.md)."""


def offered_preset(world: str) -> str:
    """Return the preset that the form offers first: `frugal` where it is shown to be no worse."""
    return "frugal" if world in FRUGAL_WORLDS else "conservative"


def too_large(config: Config) -> dict[str, str]:
    """Return which hyperparameters a new run may not have so large, each with the reason in a sentence."""
    return {
        name: f"{value:g} is more than {most:g}: {_excess(name)}. Write a number up to {most:g}, such as "
        f"{Config.model_fields[name].default:g}."
        for name, most in MOST.items()
        if (value := getattr(config, name)) > most
    }


def _excess(name: str) -> str:
    if name == "learning_rate":
        return "after such steps the policy's weights are soon no finite numbers"
    return "beside such a weight of the entropy the policy learns nothing"


def compose(
    preset: str, world: Mapping[str, object], changes: Mapping[str, object], *, strict: bool
) -> Config:
    """The preset, over it the world's own defaults, over it what this run sets (docs/paper.md, "Settings").

    `strict` refuses text in the place of a number, as JSON needs it; the command line has nothing but text.

    Raises:
        UnknownPresetError: there is no such preset.
        pydantic.ValidationError: names every field that is wrong.
    """
    if preset not in PRESETS:
        raise UnknownPresetError(preset)
    return Config.model_validate(merge(PRESETS[preset], world, changes), strict=strict)


def merge(*settings: Mapping[str, object]) -> dict[str, object]:
    """Return all settings; a later mapping overrides an earlier one, whichever name of a field each has."""
    found: dict[str, object] = {}
    for some in settings:
        named = {FIELDS.get(name, name) for name in some}
        kept = {name: value for name, value in found.items() if FIELDS.get(name, name) not in named}
        found = {**kept, **some}
    return found


class UnknownPresetError(ValueError):
    """There is no preset of that name; the sentence names the nearest and lists all."""

    def __init__(self, name: str) -> None:
        hint = did_you_mean(name, PRESETS)
        super().__init__(f"There is no preset '{name}'.{hint} The presets are: {', '.join(PRESETS)}.")
