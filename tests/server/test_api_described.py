"""The API's description of itself: complete, and every example in it fits the schema beside it."""

from collections.abc import Iterator
from typing import Any, get_args

import httpx2
import jsonschema_rs
import pytest

from parenting.server import schemas, tables
from parenting.server.api import examples
from parenting.server.app import TAGS
from tests.server.test_api_questions import lease

pytestmark = pytest.mark.only("sqlite", "the description says nothing of the store")

Operation = tuple[str, dict[str, Any]]


@pytest.fixture
def described(client: httpx2.Client) -> dict[str, Any]:
    document: dict[str, Any] = client.get("/api/v1/openapi.json").json()
    return document


def operations(described: dict[str, Any]) -> list[Operation]:
    """Each with its method and path."""
    return [
        (f"{method.upper()} {path}", operation)
        for path, methods in described["paths"].items()
        for method, operation in methods.items()
    ]


def bodies(operation: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Whatever is sent or replied: (status or "request", media with schema and examples)."""
    for media in operation.get("requestBody", {}).get("content", {}).values():
        yield "request", media
    for status, reply in operation["responses"].items():
        for media in reply.get("content", {}).values():
            yield status, media


def shown(media: dict[str, Any]) -> list[Any]:
    return (
        [media["example"]]
        if "example" in media
        else [example["value"] for example in media.get("examples", {}).values()]
    )


def fits(described: dict[str, Any], schema: dict[str, Any], value: Any) -> bool:
    whole = {**schema, "components": described["components"]}
    return jsonschema_rs.Draft202012Validator(whole).is_valid(value)


def test_every_example_fits_its_schema(described: dict[str, Any]) -> None:
    wrong = [
        (name, status, value)
        for name, operation in operations(described)
        for status, media in bodies(operation)
        for value in shown(media)
        if not fits(described, media.get("schema", {"type": "string"}), value)
    ]
    assert wrong == []


@pytest.mark.slow
def test_an_example_that_does_not_fit_would_be_found(described: dict[str, Any]) -> None:
    schema = {"$ref": "#/components/schemas/RunSchema"}
    assert fits(described, schema, examples.RUN)
    assert not fits(described, schema, {**examples.RUN, "tick": "five"})
    assert not fits(described, schema, {**examples.RUN, "status": "lost"})


def test_every_operation_shows_what_is_sent_and_what_comes_back(described: dict[str, Any]) -> None:
    bare = [
        (name, status)
        for name, operation in operations(described)
        for status, media in bodies(operation)
        if not shown(media)
    ]
    assert bare == []
    silent = [name for name, operation in operations(described) if not list(bodies(operation))]
    assert silent == []


def test_every_parameter_of_a_path_has_an_example(described: dict[str, Any]) -> None:
    for name, operation in operations(described):
        for parameter in operation.get("parameters", []):
            if parameter["in"] == "path":
                assert all(
                    fits(described, parameter["schema"], value) for value in parameter["schema"]["examples"]
                ), name
            assert parameter.get("description") or parameter["schema"].get("description"), name


def test_every_operation_is_told_in_words(described: dict[str, Any]) -> None:
    named = [operation["operationId"] for _, operation in operations(described)]
    assert len(set(named)) == len(named)
    for name, operation in operations(described):
        assert operation["operationId"].replace("_", "").isalpha(), name
        assert len(operation["summary"]) > 5, name
        assert len(operation["description"]) > len(operation["summary"]), name
        assert set(operation["tags"]) <= {tag["name"] for tag in TAGS}, name


def test_every_error_has_the_one_shape(described: dict[str, Any]) -> None:
    for name, operation in operations(described):
        errors = {
            status: reply["content"] for status, reply in operation["responses"].items() if int(status) >= 400
        }
        assert {"400", "413", "500"} <= errors.keys(), name
        for content in errors.values():
            (media,) = content.items()
            assert media[0] == "application/json", name
            assert media[1]["schema"] == {"$ref": "#/components/schemas/ErrorSchema"}, name


def test_verbs_say_that_other_sites_may_not(described: dict[str, Any]) -> None:
    for name, operation in operations(described):
        assert ({"403", "507"} <= operation["responses"].keys()) == name.startswith("POST"), name


def test_bodies_are_strict(described: dict[str, Any]) -> None:
    sent = {
        one["$ref"].rpartition("/")[2]
        for _, operation in operations(described)
        if "requestBody" in operation
        for kind, media in operation["requestBody"]["content"].items()
        if kind == "application/json"
        for schema in [media["schema"]]
        for one in schema.get("oneOf", [schema])
    }
    sent |= {"PretrainPayload", "WalkPayload", "PolicyPayload", "EpisodePayload", "StatePayload"}
    assert len(sent) == 27
    assert all(described["components"]["schemas"][name]["additionalProperties"] is False for name in sent)


@pytest.mark.parametrize("name", examples.NEW_RUNS)
def test_examples_of_new_runs_start(client: httpx2.Client, name: str) -> None:
    made = client.post("/api/v1/runs", json=examples.NEW_RUNS[name])
    assert made.status_code == 201
    assert made.json().keys() == examples.RUN.keys()


def test_examples_have_the_fields_of_real_replies(client: httpx2.Client, run: Any, guidance: int) -> None:
    leased = lease(client, run).json()
    assert leased.keys() == examples.LEASED.keys()
    assert leased["left"]["frames"][0].keys() == examples.QUERY["left"]["frames"][0].keys()
    stored = client.post(f"/api/v1/queries/{guidance}/answer", json=examples.ANSWERS["by a person"]).json()
    assert stored.keys() == examples.STORED.keys()
    asked = client.get(f"/api/v1/queries/{guidance}").json()
    assert asked.keys() == examples.ASKED.keys()
    assert asked["answer"].keys() == examples.ASKED["answer"].keys()
    exported = client.get(f"/api/v1/runs/{run.id}/export").json()
    assert exported.keys() == examples.EXPORTED.keys()


@pytest.mark.parametrize(
    ("words", "known"),
    [
        (schemas.Kind, tables.KINDS),
        (schemas.Choice, tables.CHOICES),
        (schemas.Said, tables.SAID),
        (schemas.By, tables.PARENTS),
    ],
)
def test_words_are_those_of_the_tables(words: Any, known: Any) -> None:
    assert get_args(words) == tuple(known)
