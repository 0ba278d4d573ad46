"""Tensors out of a checkpoint's bytes without torch: the web process never loads it.

`torch.save` writes a zip archive without compression: a pickle that describes the tensors, and a file with
the numbers of each storage. The pickle is read by an unpickler that knows the few names of such a
description and resolves nothing else, so reading one runs no code. Only the numbers that are asked for are
copied.
"""

from __future__ import annotations

import io
import math
import pickle
import zipfile
from collections.abc import Sequence
from typing import Any, NamedTuple

TYPES = {
    "FloatStorage": ("float32", 4),
    "DoubleStorage": ("float64", 8),
    "LongStorage": ("int64", 8),
    "CharStorage": ("int8", 1),
    "ByteStorage": ("uint8", 1),
    "BoolStorage": ("bool", 1),
}
"""The type of a storage's numbers, and the bytes of each, by the name that torch gives it."""


class UnreadableArchiveError(ValueError):
    """These bytes are not an archive of tensors, or one of its tensors cannot be read."""


class _StorageType(NamedTuple):
    dtype: str
    bytes: int


class _Storage(NamedTuple):
    dtype: str
    bytes: int
    key: str


class StoredTensor(NamedTuple):
    """A tensor in an archive: where its numbers lie."""

    dtype: str
    shape: tuple[int, ...]
    key: str  # of its storage
    begin: int  # in bytes from the beginning of the storage
    size: int  # in bytes


class TensorArchive:
    """A file of `torch.save`, of nested dictionaries of tensors, texts and numbers."""

    def __init__(self, blob: bytes) -> None:
        """Read the description; no numbers are copied yet.

        Raises:
            UnreadableArchiveError: the bytes are not such an archive.
        """
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(blob))
            (name,) = (one for one in self._zip.namelist() if one.endswith("/data.pkl"))
            self._folder = name.removesuffix("data.pkl")
            self.content: Any = _Description(io.BytesIO(self._zip.read(name))).load()
            little = self._zip.read(f"{self._folder}byteorder") == b"little"
        except Exception as error:  # damaged bytes cause almost any error in zipfile and pickle
            raise UnreadableArchiveError(f"no archive of tensors ({type(error).__name__})") from None
        if not little:
            raise UnreadableArchiveError("its numbers are big-endian")

    def read(self, tensor: StoredTensor) -> bytes:
        """Return the numbers of a tensor, in C order.

        Raises:
            UnreadableArchiveError: they are not there, or are damaged.
        """
        try:
            found = self._zip.read(f"{self._folder}data/{tensor.key}")  # holds them against their CRC
        except (KeyError, OSError, zipfile.BadZipFile) as error:
            raise UnreadableArchiveError(f"a storage cannot be read ({error})") from None
        part = found[tensor.begin : tensor.begin + tensor.size]
        if len(part) != tensor.size:
            raise UnreadableArchiveError("a storage is shorter than its tensor")
        return part


class _Description(pickle.Unpickler):
    """Reads the pickle of an archive; a name that it does not know is refused."""

    def find_class(self, module: str, name: str) -> Any:
        if module == "torch" and name in TYPES:
            return _StorageType(*TYPES[name])
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return _tensor
        if (module, name) == ("collections", "OrderedDict"):
            return dict
        raise pickle.UnpicklingError(f"{module}.{name} does not belong to a description of tensors")

    def persistent_load(self, pid: Any) -> _Storage:
        _, kind, key, *_ = pid
        return _Storage(kind.dtype, kind.bytes, str(key))


def _tensor(
    storage: _Storage, offset: int, shape: Sequence[int], stride: Sequence[int], *_: Any
) -> StoredTensor:
    dense, expected = list(stride), 1
    for axis in range(len(shape) - 1, -1, -1):
        if shape[axis] > 1 and dense[axis] != expected:
            raise pickle.UnpicklingError("a tensor is not stored in C order")
        expected *= shape[axis]
    size = math.prod(shape) * storage.bytes
    return StoredTensor(storage.dtype, tuple(shape), storage.key, offset * storage.bytes, size)
