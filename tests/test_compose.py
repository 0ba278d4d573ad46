"""docker-compose.yml, Dockerfile and .dockerignore keep their promises, read as text."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from parenting.commands.main import COMMANDS
from parenting.server.notify import Notifier
from parenting.server.settings import Settings
from tests.services import image_check, image_environment, read_compose, read_dockerfile
from tests.tree import LINKS, ROOT

SERVICES = ("migrate", "web", "worker")
SOCKETS = "sockets:/run/postgresql"
LASTING = ("web", "worker")
DATABASE = "postgres"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def compose() -> dict[str, Any]:
    return read_compose()


def values(instruction: str) -> list[str]:
    return [rest for name, rest in read_dockerfile() if name == instruction]


def seconds(text: str) -> int:
    found = re.fullmatch(r"(\d+)s", text)
    assert found is not None, text
    return int(found[1])


def test_there_are_three_services_and_a_database_by_its_profile(compose: dict[str, Any]) -> None:
    assert tuple(compose["services"]) == (*SERVICES, DATABASE)
    assert [name for name, one in compose["services"].items() if "profiles" in one] == [DATABASE]


@pytest.mark.parametrize("name", [*SERVICES, DATABASE])
def test_service_may_do_no_more_than_it_must(compose: dict[str, Any], name: str) -> None:
    service = compose["services"][name]
    assert service["user"] == ("999:999" if name == DATABASE else "10001:10001")
    assert service["read_only"] is True
    assert service["tmpfs"] == ["/tmp"]
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert not {"privileged", "cap_add", "devices", "pid", "ipc", "env_file", "secrets"} & set(service)


@pytest.mark.parametrize("name", SERVICES)
def test_service_shares_named_volumes_and_nothing_of_the_host(compose: dict[str, Any], name: str) -> None:
    service = compose["services"][name]
    assert service["volumes"] == ["data:/data", SOCKETS]
    assert service["environment"]["PARENTING_DATA"] == "/data"
    assert list(compose["volumes"]) == ["data", DATABASE, "sockets"]


def test_the_database_is_reached_over_its_socket_alone(compose: dict[str, Any]) -> None:
    """So it needs neither a network nor a password; and without its profile all go on with SQLite."""
    service = compose["services"][DATABASE]
    assert service["network_mode"] == "none"
    assert "ports" not in service
    assert service["command"] == ["postgres", "-c", "listen_addresses=", "-c", "max_connections=200"]
    assert service["volumes"] == ["postgres:/var/lib/postgresql/data", SOCKETS]
    assert not any("PASSWORD" in name for name in service["environment"])
    needed = {"postgres": {"condition": "service_healthy", "required": False}}
    assert compose["services"]["migrate"]["depends_on"] == needed
    assert {compose["services"][name]["environment"]["PARENTING_DATABASE_URL"] for name in SERVICES} == {""}
    assert any("install -d -m 1777 /run/postgresql" in run for run in values("RUN"))


@pytest.mark.parametrize("name", SERVICES)
def test_service_stops_in_order(compose: dict[str, Any], name: str) -> None:
    """init: SIGTERM ends process 1 only if it has a handler, and a program that still loads has none."""
    assert compose["services"][name]["init"] is True
    assert seconds(compose["services"][name]["stop_grace_period"]) > 5


@pytest.mark.parametrize("name", SERVICES)
def test_service_is_of_this_version(compose: dict[str, Any], name: str) -> None:
    service = compose["services"][name]
    assert service["image"] == f"parenting:{PROJECT['project']['version']}"
    assert service["build"] == {"context": ".", "args": {"TORCH_INDEX": ""}}


def test_tables_are_made_before_anyone_reads_them(compose: dict[str, Any]) -> None:
    assert compose["services"]["migrate"]["restart"] == "no"
    for name in LASTING:
        service = compose["services"][name]
        assert service["depends_on"] == {"migrate": {"condition": "service_completed_successfully"}}
        assert service["restart"] == "unless-stopped"


def test_only_the_web_is_on_a_network_and_only_on_loopback(compose: dict[str, Any]) -> None:
    services = compose["services"]
    port = services["web"]["environment"]["PARENTING_PORT"]
    assert services["web"]["ports"] == [f"127.0.0.1:{port}:{port}"]
    for name in ("migrate", "worker"):
        assert services[name]["network_mode"] == "none"
        assert "ports" not in services[name]
    assert not {"network_mode", "networks", "expose"} & set(services["web"])


def test_only_that_web_listens_beyond_its_loopback(compose: dict[str, Any]) -> None:
    """The image by itself does not: who publishes its port has to say so."""
    opening = {"PARENTING_HOST": "0.0.0.0", "PARENTING_PUBLISHED_ON_LOOPBACK": "true"}
    assert compose["services"]["web"]["environment"].items() >= opening.items()
    for environment in (
        image_environment(),
        *(compose["services"][name]["environment"] for name in SERVICES[::2]),
    ):
        assert not set(opening) & set(environment)


@pytest.mark.parametrize("name", SERVICES)
def test_environment_holds_settings_and_no_secret(compose: dict[str, Any], name: str) -> None:
    known = {f"PARENTING_{field.upper()}" for field in Settings.model_fields}
    assert set(compose["services"][name]["environment"]) <= known
    assert set(image_environment()) <= known | {"PYTHONUNBUFFERED"}


def test_health_is_checked(compose: dict[str, Any]) -> None:
    for name in LASTING:
        check = compose["services"][name]["healthcheck"]
        assert check["test"][0] == "CMD"
        assert seconds(check["timeout"]) < seconds(check["interval"])
        assert check["retries"] > 1
    assert compose["services"]["web"]["healthcheck"]["test"] == image_check()
    assert compose["services"]["migrate"]["healthcheck"] == {"disable": True}


@pytest.mark.parametrize("name", SERVICES)
def test_service_runs_a_command_of_ours(compose: dict[str, Any], name: str) -> None:
    assert compose["services"][name]["command"] == ["parenting", name]
    assert name in COMMANDS


def test_images_are_named_with_their_version() -> None:
    bases = [base.split(" AS ")[0] for base in values("FROM")]
    assert bases == ["python:3.11-slim"] * 2


def test_image_runs_as_a_user_who_owns_the_data() -> None:
    names = [name for name, _ in read_dockerfile()]
    assert values("USER") == ["10001:10001"]
    assert not {"RUN", "COPY", "ADD"} & set(names[names.index("USER") :])
    assert any("install -d -o 10001 -g 10001 -m 700 /data" in run for run in values("RUN"))
    assert values("VOLUME") == ["/data"]
    assert image_environment()["PARENTING_DATA"] == "/data"


def test_image_starts_our_command_without_a_shell() -> None:
    (command,) = [json.loads(rest) for rest in values("CMD")]
    assert command[0] == "parenting"
    assert command[1] in COMMANDS
    assert values("ENTRYPOINT") == []


def test_image_takes_exact_versions_and_nothing_from_elsewhere() -> None:
    installs = [part for run in values("RUN") for part in re.split(r"&&|;", run) if "pip install" in part]
    assert installs
    assert all("--no-cache-dir" in part for part in installs)
    assert all("-c constraints.txt" in part or "--no-deps /wheel" in part for part in installs)
    assert values("ADD") == []
    assert values("ARG") == ['TORCH_INDEX=""']


def test_libraries_have_a_layer_that_no_change_of_code_undoes() -> None:
    """Earlier steps of the last stage copy no code."""
    rows = read_dockerfile()
    last = rows[max(index for index, (name, _) in enumerate(rows) if name == "FROM") :]
    assert [rest for name, rest in last if name == "COPY"] == ["pyproject.toml constraints.txt ./"]


def test_build_sees_the_packages_and_nothing_else() -> None:
    lines = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    rules = [line for line in lines if not line.startswith("#")]
    packages = {"parenting", *(Path(link).name for link in LINKS)}
    files = {
        "pyproject.toml",
        "constraints.txt",
        PROJECT["project"]["readme"],
        *PROJECT["project"]["license-files"],
    }
    assert rules[0] == "*"
    assert {rule[1:] for rule in rules if rule.startswith("!")} == packages | files
    assert [rule for rule in rules[1:] if not rule.startswith("!")] == ["**/__pycache__", "**/*.pyc"]


@pytest.mark.parametrize("name", ["web", "worker"])
def test_sockets_of_containers_lie_in_the_folder_that_they_share(name: str) -> None:
    """A longer path would put them into /tmp, which every container has for itself."""
    assert Notifier(Path(image_environment()["PARENTING_DATA"]), name).folder == Path("/data/sockets", name)
