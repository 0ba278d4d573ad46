"""The file system of a path is that of the mount that holds it; those of the network are known."""

from __future__ import annotations

from pathlib import Path

import pytest

from parenting.server.store import file_system
from parenting.server.store.file_system import is_network, kind_of

MOUNTS = """\
21 1 254:0 / / rw,relatime shared:1 - ext4 /dev/vda rw
30 21 0:40 / {0} rw - tmpfs tmpfs rw
31 30 0:41 / {0}/far rw,relatime - nfs4 server:/far rw
32 31 0:42 / {0}/far/a\\040b rw - fuse.sshfs me@there: rw
33 30 0:43 / {0}/farther rw - xfs /dev/sda rw
34 30 0:44 / {0}/twice rw - xfs /dev/sda rw
35 30 0:45 / {0}/twice rw - cifs //server/x rw
broken line
"""


@pytest.mark.parametrize(
    ("place", "kind", "network"),
    [
        ("", "tmpfs", False),
        ("far/data/parenting.db", "nfs4", True),
        ("farther/me", "xfs", False),
        ("far/a b/data", "fuse.sshfs", True),
        ("twice/x", "cifs", True),
    ],
)
def test_the_nearest_mount_decides(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str, kind: str, network: bool
) -> None:
    for name in ("far/a b", "farther", "twice"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "mounts").write_text(MOUNTS.format(tmp_path))
    monkeypatch.setattr(file_system, "MOUNTS", tmp_path / "mounts")
    assert kind_of(tmp_path / place) == kind
    assert is_network(kind) is network


def test_a_link_leads_to_its_file_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("far/a b", "farther", "twice"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "link").symlink_to(tmp_path / "far")
    (tmp_path / "mounts").write_text(MOUNTS.format(tmp_path))
    monkeypatch.setattr(file_system, "MOUNTS", tmp_path / "mounts")
    assert kind_of(tmp_path / "link" / "parenting.db") == "nfs4"


def test_where_the_system_does_not_tell_it_is_unknown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file_system, "MOUNTS", tmp_path / "none")
    assert kind_of(tmp_path) == "unknown"
    assert not is_network("unknown")
