"""Frozen records of tensors whose fields declare their shapes.

A `Struct` is a frozen dataclass. Its tensor fields are annotated as in ``UInt8[Tensor, "N H W"]``.
The axis named ``N`` is the axis of trials, wherever it stands; `pick`, `where` and `joined` follow it.
Shapes are checked by `check`, which tests and checkpoint loading call; the hot loop never does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, Self, dataclass_transform, get_type_hints

import torch
from jaxtyping import jaxtyped
from torch import Tensor


@dataclass_transform(frozen_default=True, eq_default=False)
class Struct:
    """A frozen dataclass of tensors, of further structs, and of dictionaries of tensors."""

    def __init_subclass__(cls, **options: Any) -> None:
        """Make every subclass a frozen dataclass, so that no field is assigned to by accident."""
        super().__init_subclass__(**options)
        dataclass(frozen=True, eq=False, repr=False)(cls)

    def __repr__(self) -> str:
        """Name the fields with their shapes: the numbers themselves would fill a screen."""
        shapes = [f"{name} {tuple(tensor.shape)}" for name, tensor, _ in self.leaves()]
        more = f", and {len(shapes) - 4} more" if len(shapes) > 5 else ""
        return f"<{type(self).__name__}: {', '.join(shapes[:4] if more else shapes)}{more}>"

    def replace(self, **changes: Any) -> Self:
        """The same record with some fields changed.

        A tick does this a dozen times, and `dataclasses.replace` would take three times as long.

        Raises:
            TypeError: there is no such field.
        """
        kind, mine = type(self), self.__dict__
        names = _axes(kind)
        other = object.__new__(kind)
        values = other.__dict__
        for name in names:  # not all of `mine`: what was cached there belongs to this record
            values[name] = mine[name]
        values.update(changes)
        if len(values) != len(names):
            raise TypeError(f"{kind.__name__} has no field {', '.join(set(changes) - set(names))}.")
        return other

    def leaves(self, prefix: str = "") -> Iterator[tuple[str, Tensor, int | None]]:
        """Every tensor below, as (dotted name, tensor, axis of trials or None), as declared."""
        for name, axis in _axes(type(self)).items():
            value = getattr(self, name)
            if isinstance(value, Struct):
                yield from value.leaves(f"{prefix}{name}.")
            elif isinstance(value, dict):
                yield from ((f"{prefix}{name}.{key}", item, axis) for key, item in value.items())
            elif isinstance(value, Tensor):
                yield f"{prefix}{name}", value, axis

    def tensors(self) -> dict[str, Tensor]:
        """Every tensor below by its dotted name."""
        return {name: tensor for name, tensor, _ in self.leaves()}

    def map(self, function: Callable[[str, Tensor, int | None], Tensor], prefix: str = "") -> Self:
        """The same record with `function(name, tensor, axis)` in place of every tensor."""
        changes: dict[str, Any] = {}
        for name, axis in _axes(type(self)).items():
            value, path = getattr(self, name), f"{prefix}{name}"
            if isinstance(value, Struct):
                changes[name] = value.map(function, f"{path}.")
            elif isinstance(value, dict):
                changes[name] = {key: function(f"{path}.{key}", item, axis) for key, item in value.items()}
            elif isinstance(value, Tensor):
                changes[name] = function(path, value, axis)
        return self.replace(**changes)

    def pick(self, index: Tensor) -> Self:
        """The trials of `index` (integers, or a mask over the trials), in that order."""
        where = index.nonzero().squeeze(1) if index.dtype == torch.bool else index
        return self.map(
            lambda _name, tensor, axis: tensor if axis is None else tensor.index_select(axis, where)
        )

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """The trials of all parts, one part after the other; what has no axis of trials is the first part's.

        Raises:
            IndexError: there is no part.
        """
        every = [part.tensors() for part in parts]

        def join(name: str, tensor: Tensor, axis: int | None) -> Tensor:
            return tensor if axis is None else torch.cat([one[name] for one in every], axis)

        return parts[0].map(join)

    def where(self, mask: Tensor, other: Self) -> Self:
        """This record's trials where `mask` holds, the other's elsewhere. Both must have the same shapes.

        Where it holds in all of them, this record itself: nothing is copied.
        """
        if bool(mask.all()):
            return self
        theirs = other.tensors()

        def choose(name: str, tensor: Tensor, axis: int | None) -> Tensor:
            if axis is None:
                return tensor
            shape = [1] * tensor.dim()
            shape[axis] = -1
            return torch.where(mask.view(shape), tensor, theirs[name])

        return self.map(choose)

    def clone(self) -> Self:
        """A copy that shares no memory."""
        return self.map(lambda _name, tensor, _axis: tensor.clone())

    def check(self) -> Self:
        """Hold every field against its declared dtype and shape, one meaning for each axis name.

        Raises:
            TypeError: names the field, what was declared and what stands there.
        """
        with jaxtyped("context"):
            self._check("")
        return self

    def _check(self, prefix: str) -> None:
        for name, hint in get_type_hints(type(self)).items():
            value = getattr(self, name)
            if isinstance(value, Struct):
                value._check(f"{prefix}{name}.")
                continue
            items = value.values() if isinstance(value, dict) else [value]
            declared = hint.__args__[1] if isinstance(value, dict) else hint
            for item in items:
                if isinstance(item, Tensor) and not isinstance(item, declared):
                    found = f"{item.dtype} {tuple(item.shape)}"
                    raise TypeError(f"{type(self).__name__}: {prefix}{name} must be {declared}, not {found}")


_AXES: dict[type[Struct], dict[str, int | None]] = {}


def _axes(kind: type[Struct]) -> dict[str, int | None]:
    """The axis of trials of every field: where the declared shape has ``N``, or None where it has not."""
    if kind not in _AXES:
        hints = get_type_hints(kind)
        _AXES[kind] = {field.name: _axis(hints[field.name]) for field in fields(kind)}  # type: ignore[arg-type]
    return _AXES[kind]


def _axis(hint: Any) -> int | None:
    declared = hint.__args__[1] if getattr(hint, "__origin__", None) is dict else hint
    names = str(getattr(declared, "dim_str", "")).split()
    return names.index("N") if "N" in names else None
