"""The kind of file system that holds a path: SQLite needs one of this machine.

Locks and shared memory of network file systems do not keep SQLite's promises: two processes may write at
once.
"""

from __future__ import annotations

import os
from pathlib import Path

MOUNTS = Path("/proc/self/mountinfo")
NETWORK = (
    *("9p", "afs", "beegfs", "ceph", "cifs", "coda", "davfs", "drvfs", "gfs2", "glusterfs", "gpfs", "lustre"),
    *("ncpfs", "nfs", "nfs4", "ocfs2", "orangefs", "prl_fs", "smb2", "smb3", "smbfs", "vboxsf", "virtiofs"),
    "vmhgfs",
)
"""Kinds that others write to as well, folders shared with a virtual machine's host among them."""
NETWORK_FUSE = ("ceph", "gcsfuse", "gluster", "goofys", "grpcfuse", "juicefs", "rclone", "s3fs", "sshfs")
UNKNOWN = "unknown"


def kind_of(path: Path) -> str:
    """Return the kind of file system that holds a path, such as ext4; `unknown` where Linux does not tell.

    The path need not exist: its nearest folder that does decides.
    """
    there = Path(os.path.realpath(path))
    there = next((one for one in (there, *there.parents) if one.exists()), Path("/"))
    try:
        mounts = MOUNTS.read_text(encoding="utf-8", errors="surrogateescape").splitlines()
    except OSError:
        return UNKNOWN
    best, kind = "", UNKNOWN
    for line in mounts:
        before, _, behind = line.partition(" - ")
        fields, rest = before.split(), behind.split()
        if len(fields) < 5 or not rest:
            continue
        point = _unescaped(fields[4])
        if there.is_relative_to(point) and len(point) >= len(best):  # the last of two at one place covers
            best, kind = point, rest[0]
    return kind


def is_network(kind: str) -> bool:
    """Return whether a kind of file system may be written by other machines."""
    return kind in NETWORK or (kind.startswith("fuse") and any(name in kind for name in NETWORK_FUSE))


def _unescaped(point: str) -> str:
    """Return a mount point without Linux's escapes of blanks."""
    for code, letter in (("\\040", " "), ("\\011", "\t"), ("\\012", "\n"), ("\\134", "\\")):
        point = point.replace(code, letter)
    return point
