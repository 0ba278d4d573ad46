"""Settings that cannot be, and a file of settings that others can read, are findings of the doctor."""

from __future__ import annotations

from pathlib import Path

import pytest

from parenting.server.doctor import machine
from parenting.server.settings import Settings
from tests.server.doctor.examined import examined, states


@pytest.mark.parametrize(
    ("line", "mode", "told"),
    [
        ("PARENTING_DATABASE_URL=sqlite:///x.db", 0o644, False),
        ("PARENTING_DATABASE_URL=postgresql://me:pa55@127.0.0.1:1/x", 0o600, False),
        ("PARENTING_DATABASE_URL=postgresql://me:pa55@127.0.0.1:1/x", 0o640, True),
        ("PARENTING_DATABASE_URL=postgresql://127.0.0.1:1/x?password=pa55", 0o604, True),
        ("PARENTING_TOKEN=pa55", 0o644, True),
    ],
)
def test_a_file_with_a_password_is_its_owners_alone(
    settings: Settings, line: str, mode: int, told: bool
) -> None:
    file = Path(".env").absolute()
    file.write_text(f"{line}\n", encoding="utf-8")
    file.chmod(mode)
    found = list(machine.settings_file())
    assert [one.remedy for one in found if one.state == "warning"] == [f"chmod 600 {file}"] * told
    assert "pa55" not in str(found)


@pytest.mark.parametrize(
    ("name", "value"), [("PORT", "x"), ("DATABASE_URL", "nothing"), ("DATABASE_URL", "a://b:c/d")]
)
def test_a_wrong_setting_is_a_finding(
    settings: Settings, monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    monkeypatch.setenv(f"PARENTING_{name}", value)
    code, found = examined()
    assert (code, states(found)) == (2, {"settings": "error"})
    assert found["settings"]["said"].startswith(f"PARENTING_{name}: ")
