"""A pretended device: its tensors lie in main memory, but refuse to meet others, as those of a GPU do.

Tensors call themselves `meta`, the one device besides `cpu` for which autograd needs no driver. So code runs
to its end without a GPU, and an operation on tensors of two devices fails where it stands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import torch
from torch import Tensor
from torch.overrides import TorchFunctionMode
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_flatten, tree_map

NAME = "meta"
COPIES = (torch.ops.aten._to_copy.default, torch.ops.aten.copy_.default)
"""Calls that may take a tensor from one device to another."""
PLACES = (torch.ops.aten.index.Tensor, torch.ops.aten.index_put_.default, torch.ops.aten.index_put.default)
"""Calls that allocate main memory for a tensor elsewhere, on a GPU too."""


class Apart(RuntimeError):
    """Tensors of two devices met."""


class Elsewhere(Tensor):
    """A tensor on the pretended device; `held` is what it stands for."""

    held: Tensor

    @staticmethod
    def __new__(cls, held: Tensor) -> Elsewhere:
        """Wrap a tensor of main memory."""
        one: Elsewhere = torch.Tensor._make_wrapper_subclass(
            cls,
            held.size(),
            strides=held.stride(),
            storage_offset=held.storage_offset(),
            dtype=held.dtype,
            device=torch.device(NAME),
        )
        one.held = held
        return one

    @classmethod
    def __torch_dispatch__(  # type: ignore[override]
        cls,
        func: Any,
        types: Sequence[type],
        args: Sequence[Any] = (),
        kwargs: Mapping[str, Any] | None = None,
    ) -> Any:
        """Do it in main memory."""
        return perform(func, args, dict(kwargs or {}))


def perform(func: Any, args: Sequence[Any], kwargs: dict[str, Any]) -> Any:
    """An operation in main memory; what comes of it lies where a GPU would leave it."""
    wanted = kwargs.get("device")
    leaves = [leaf for leaf in tree_flatten((args, kwargs))[0] if isinstance(leaf, Tensor)]
    away = any(isinstance(leaf, Elsewhere) for leaf in leaves)
    strangers = [leaf for leaf in leaves if not isinstance(leaf, Elsewhere) and leaf.dim()]
    if away and strangers and func not in (*COPIES, *PLACES):
        raise Apart(f"{func} on tensors of {NAME} and of cpu, {tuple(strangers[0].shape)}")
    if wanted is not None:
        generator = kwargs.get("generator")
        if generator is not None and generator.device != torch.device(wanted):
            raise Apart(f"{func} on {wanted} by a generator of {generator.device}")
        kwargs["device"] = torch.device("cpu")
        away = torch.device(wanted).type == NAME
    if func is torch.ops.aten.copy_.default:
        away = isinstance(args[0], Elsewhere)
    plain_args, plain_kwargs = tree_map(_held, (tuple(args), kwargs))
    found = func(*plain_args, **plain_kwargs)
    mine = {id(_held(leaf)): leaf for leaf in leaves}  # what is changed in place stays the same tensor
    return tree_map(lambda one: mine.get(id(one), _away(one) if away else one), found)


def _held(one: Any) -> Any:
    return one.held if isinstance(one, Elsewhere) else one


def _away(one: Any) -> Any:
    return Elsewhere(one) if isinstance(one, Tensor) else one


class _Operations(TorchDispatchMode):  # type: ignore[no-untyped-call]
    """Catches what makes tensors out of nothing."""

    @classmethod
    def _should_skip_dynamo(cls) -> bool:
        return False  # nothing is compiled here, and loading the compiler takes seconds

    def __torch_dispatch__(
        self,
        func: Any,
        types: Sequence[type],
        args: Sequence[Any] = (),
        kwargs: Mapping[str, Any] | None = None,
    ) -> Any:
        return perform(func, args, dict(kwargs or {}))


class _Functions(TorchFunctionMode):
    """Lists become tensors, and tensors lists, by ways that know devices of their own."""

    def __torch_function__(
        self,
        func: Callable[..., Any],
        types: Sequence[type],
        args: Sequence[Any] = (),
        kwargs: Mapping[str, Any] | None = None,
    ) -> Any:
        more = dict(kwargs or {})
        if func in (torch.tensor, torch.as_tensor):
            there = torch.device(more.pop("device", None) or "cpu")
            made = func(*args, **more, device="cpu")
            return Elsewhere(made) if there.type == NAME else made
        if func is torch.Tensor.tolist and isinstance(args[0], Elsewhere):
            return args[0].held.tolist()
        return func(*args, **more)


@contextmanager
def elsewhere() -> Iterator[None]:
    """The pretended device is there, under the name of `NAME`."""
    with _Operations(), _Functions():  # type: ignore[no-untyped-call]
        yield
