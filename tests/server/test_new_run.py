"""A run from a web form: text becomes numbers, an empty field is an absent one."""

import pytest
from annotated_types import Le, Lt

from parenting.agent.config import MOST, Config
from parenting.server.db import Database
from parenting.server.errors import InvalidFieldsError
from parenting.server.new_run import NewRun, plan, start
from parenting.server.run_form import read_form

WORLD = "unsafe-exploration"


def test_form_is_read_as_its_fields_mean(db: Database) -> None:
    form = {
        "world": WORLD,
        "level": "island-bottleneck",
        "level_text": "",
        "name": " ",
        "parent": "scripted",
        "preset": "lax",
        "seed": "17",
        "config.p_rec": "0.25",
        "config.stages": "2",
        "config.recompare": "true",
        "config.batch": "",
        "config.dtype": "float64",
        "submit": "Start",
    }
    run = start(db, read_form(form))
    assert (run.level, run.name, run.parent, run.preset, run.seed) == (
        "island-bottleneck",
        None,
        "scripted",
        "lax",
        17,
    )
    assert run.config["p_rec"] == 0.25
    assert run.config["stages"] == 2
    assert run.config["recompare"] is True
    assert run.config["batch"] is None
    assert run.config["dtype"] == "float64"


def test_empty_seed_is_zero() -> None:
    assert read_form({"world": WORLD, "seed": ""}).seed == 0


@pytest.mark.parametrize(
    ("form", "field"),
    [
        ({}, "world"),
        ({"world": WORLD, "seed": "x"}, "seed"),
        ({"world": WORLD, "seed": "1.5"}, "seed"),
        ({"world": WORLD, "seed": "[1]"}, "seed"),
        ({"world": WORLD, "seed": "9" * 5000}, "seed"),
        ({"world": WORLD, "config.p_guid": "NaN"}, "config.p_guid"),
        ({"world": WORLD, "name": "\ud800"}, "name"),
    ],
)
def test_wrong_field_of_a_form_is_named(form: dict[str, str], field: str) -> None:
    with pytest.raises(InvalidFieldsError) as caught:
        read_form(form)
    assert [name for name, _ in caught.value.fields] == [field]


@pytest.mark.parametrize(("text", "part"), [("many", "valid number"), ("2", "less than or equal to 1")])
def test_wrong_hyperparameter_is_named(text: str, part: str) -> None:
    with pytest.raises(InvalidFieldsError, match=part) as caught:
        plan(read_form({"world": WORLD, "config.p_guid": text}))
    assert caught.value.field == "config.p_guid"


@pytest.mark.parametrize(
    ("name", "value", "most", "usual"),
    [
        ("learning_rate", 1e308, 1, "0.001"),
        ("learning_rate", 1.5, 1, "0.001"),
        ("lambda_global", 1e308, 100, "0.01"),
        ("lambda_local", 100.5, 100, "0.01"),
    ],
)
def test_a_number_that_is_too_large_is_named_with_its_bound(
    name: str, value: float, most: int, usual: str
) -> None:
    with pytest.raises(InvalidFieldsError) as caught:
        plan(NewRun(world=WORLD, config={name: value}))
    assert caught.value.field == f"config.{name}"
    assert f"{value:g} is more than {most}: " in caught.value.message
    assert caught.value.message.endswith(f"Write a number up to {most}, such as {usual}.")


@pytest.mark.parametrize("name", MOST)
def test_a_number_at_its_bound_is_taken_and_stored_ones_are_read(name: str) -> None:
    assert plan(NewRun(world=WORLD, config={name: MOST[name]}))["config"][name] == MOST[name]
    assert getattr(Config.model_validate({name: 1e308}), name) == 1e308


def test_every_number_of_a_new_run_has_a_largest() -> None:
    """By its field's own bound, or by `MOST`."""
    numbers = {name: field for name, field in Config.model_fields.items() if field.annotation is float}
    bound = {
        name for name, field in numbers.items() if any(isinstance(one, Le | Lt) for one in field.metadata)
    }
    assert set(numbers) - bound == set(MOST)


def test_each_of_several_has_its_message() -> None:
    new = NewRun(world="mars", preset="x")
    with pytest.raises(InvalidFieldsError) as caught:
        plan(new)
    assert [error["field"] for error in caught.value.body()["error"]["fields"]] == ["world", "preset"]
    assert caught.value.field is None
