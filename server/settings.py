"""Settings of web and worker, from the environment (prefix `PARENTING_`) or from the command line."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Literal

from pydantic import Field, SecretStr, field_validator
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict
from sqlalchemy import URL

from parenting.server.environment import PREFIX, EnvironmentFile, wanted
from parenting.weights.cost import Bound

FILE = Path(".env")
"""Settings of the folder where the program is started."""
YEAR = 31_536_000
"""Seconds of a year: much longer times have no date."""
MOST = 10**9
"""The largest number of what is counted; a column of the database holds little more."""
SOURCES = re.compile(r"[!-+\--:<-~]+(?: +[!-+\--:<-~]+)*")
"""Source expressions of a Content-Security-Policy: a ; or , would begin another directive or policy."""


def state_folder() -> Path:
    """Return the default data folder: `parenting` in XDG's state folder."""
    state = os.environ.get("XDG_STATE_HOME", "")
    root = Path(state) if Path(state).is_absolute() else Path.home() / ".local" / "state"
    return root / "parenting"


class Settings(BaseSettings):
    """The settings of web and worker. Each is set by `PARENTING_` and its name in capitals.

    Raises:
        SetupError: the file `.env` cannot be read.
    """

    model_config = SettingsConfigDict(
        env_prefix=PREFIX, env_ignore_empty=True, extra="ignore", allow_inf_nan=False
    )

    data: Path = Field(
        default_factory=state_folder,
        description="Folder of the database and of the sockets that wake processes.",
    )
    database_url: str | None = Field(
        None,
        description="Another database, as SQLAlchemy writes it; none is parenting.db in the data folder.",
    )
    host: str = Field(
        "127.0.0.1", description="Address to listen on; one that others reach needs `public`, or a container."
    )
    port: int = Field(8765, ge=0, le=65535, description="Port to listen on; 0 takes a free one.")
    public: bool = Field(
        False,
        description="Others reach the server, by way of a proxy that terminates TLS; plain http is refused.",
    )
    hosts: str = Field("", description="Names under which a public server is reached, joined by commas.")
    trusted_proxies: str = Field(
        "127.0.0.1",
        description="Addresses or networks of a public server's proxies, joined by commas; only these are "
        "believed what they say of their clients.",
    )
    published_on_loopback: bool = Field(
        False,
        description="The server runs in a container whose port is published on its host's loopback only, so "
        "it may listen on 0.0.0.0 without a proxy.",
    )
    session_days: float = Field(
        30.0, gt=0, le=3660, description="Days after which whoever entered by a browser has to enter again."
    )
    session_idle_days: float = Field(
        7.0, gt=0, le=3660, description="Days without use after which they have to."
    )
    token: SecretStr | None = Field(
        None, description="Token that commands send to a server (`parenting access create token`)."
    )
    lease_seconds: float = Field(
        60.0, gt=0, le=YEAR, description="How long a question is held for the parent who was shown it."
    )
    attention_seconds: float = Field(
        120.0,
        gt=0,
        le=YEAR,
        description="How long after a parent's last sign of life (pointer, key, scroll, focus, touch) their "
        "question is still held.",
    )
    listen_after_ms: int = Field(
        200,
        ge=0,
        le=10_000,
        description="How long a question is on the screen before the parent's page takes an answer to it.",
    )
    languages: Path | None = Field(
        None,
        description="Folder of the languages that the parent's pages can be read in, besides English; "
        "none is the one of this package, web/languages.",
    )
    claim_seconds: float = Field(
        5.0, gt=0, le=YEAR, description="How long a run stays with a worker that gives no sign of life."
    )
    lives: int = Field(
        100,
        ge=1,
        le=MOST,
        description="Agents that a worker keeps in memory; others that wait are in their checkpoints.",
    )
    lives_megabytes: float = Field(
        500.0, gt=0, description="Megabytes of the tensors of those agents, as far as the others wait."
    )
    runs: int = Field(
        5000, ge=1, le=MOST, description="Runs that may live at once; those that are over do not count."
    )
    runs_per_client: int = Field(
        250,
        ge=1,
        le=MOST,
        description="Living runs that one address may have started on the pages or the API.",
    )
    frame_ancestors: str = Field(
        "none",
        description="Sites that may show the pages in a frame, as the header Content-Security-Policy names "
        "them; a notebook needs http://localhost:*.",
    )
    streams: int = Field(300, ge=1, le=MOST, description="Live streams of events that may be open at once.")
    streams_per_browser: int = Field(
        12, ge=1, le=MOST, description="Live streams of one browser at once, by its cookie."
    )
    streams_per_client: int = Field(
        100,
        ge=1,
        le=MOST,
        description="Live streams of one address at once; loopback, where a proxy stands, has no such limit.",
    )
    connections: int = Field(
        1000, ge=1, le=60_000, description="Connections that may be open at once; the longest idle make room."
    )
    connections_per_client: int = Field(
        250,
        ge=1,
        le=MOST,
        description="Connections of one address at once; loopback, where a proxy stands, has no such limit.",
    )
    tick_seconds: float = Field(
        2.0, gt=0, description="Seconds that a tick of a new run may take, as estimated from its level."
    )
    checkpoint_megabytes: float = Field(
        500.0, gt=0, description="Megabytes that a checkpoint of a new run may have, as estimated."
    )
    ballast: bool = Field(
        True, description="Keep 8 MB of disk space beside a SQLite database, for when the disk is full."
    )
    trackers: str = Field(
        "",
        description="Trackers that a worker feeds, joined by commas: csv:FOLDER, jsonl:FOLDER, "
        "tensorboard:FOLDER, or MODULE:NAME.",
    )
    log_level: str = Field("warning", description="debug, info, warning or error.")
    log_format: Literal["text", "json"] = Field("text", description="text for people, or json, a line each.")
    log_folder: Path | None = Field(
        None, description="Folder of log files, one for each process; none is standard error."
    )
    log_bytes: int = Field(
        10_000_000,
        ge=10_000,
        le=10**12,
        description="Size at which a log file is renamed and a new one begun.",
    )
    log_files: int = Field(5, ge=1, le=1000, description="How many renamed log files are kept.")

    @field_validator("frame_ancestors")
    @classmethod
    def _only_sources(cls, value: str) -> str:
        if not SOURCES.fullmatch(value):
            raise ValueError("write sources in printable ASCII, with spaces between them, without ; and ,")
        return value

    @field_validator("languages")
    @classmethod
    def _is_there(cls, value: Path | None) -> Path | None:
        if value is not None and not os.path.isdir(value):
            raise ValueError("there is no such folder; make it, or leave this setting out")
        return value

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Read options first, then the environment, then the file."""
        file = EnvironmentFile(settings_cls, env_file=FILE, env_file_encoding="utf-8-sig")
        return init_settings, env_settings, file

    @property
    def weights(self) -> Path:
        """Return the folder where `parenting pretrain` writes weights and where new runs look for them."""
        return self.data / "weights"

    @property
    def bound(self) -> Bound:
        """Return the most that a new run may cost."""
        return Bound(self.tick_seconds, self.checkpoint_megabytes)

    @property
    def url(self) -> str:
        """Return the database's URL."""
        if self.database_url:
            return self.database_url
        path = (self.data / "parenting.db").absolute()
        return URL.create("sqlite", database=str(path)).render_as_string(hide_password=False)


def logs_json() -> bool:
    """Return whether the log is to be JSON, even if other settings are wrong."""
    return wanted(f"{PREFIX}LOG_FORMAT", FILE) == "json"


def names() -> list[str]:
    """Return the settings' names as variables of the environment."""
    return [PREFIX + name.upper() for name in Settings.model_fields]
