"""Checks of single arguments, each with a sentence that names the argument, its value and the remedy."""

from __future__ import annotations

from operator import index
from pathlib import Path

import torch

from parenting.agent.parent import Parent


def check_number(name: str, value: object, least: int, most: int) -> int:
    """Return an argument, such as an integer of NumPy; refuse what is not a whole number within bounds.

    Raises:
        ValueError: the message names the argument, its value and the bounds.
    """
    try:
        found = least - 1 if isinstance(value, bool) else index(value)  # type: ignore[arg-type]
    except TypeError:
        found = least - 1
    if least <= found <= most:
        return found
    raise ValueError(f"{name}: {value!r} is not a whole number from {least} to {most}.")


def check_device(device: object) -> None:
    """Refuse a device that torch does not know or that this machine does not have.

    Raises:
        ValueError: the message names the device.
    """
    try:
        torch.empty(0, device=device)  # type: ignore[call-overload]
    except (RuntimeError, AssertionError, TypeError):
        raise ValueError(
            f'device: {device!r} is not a device of torch on this machine. Use "cpu", or "cuda" where there'
            " is a GPU of NVIDIA."
        ) from None


def check_parent(parent: object) -> Parent:
    """Return a parent; refuse what is not one.

    Raises:
        ValueError: the message names what was given, and what to give.
    """
    if isinstance(parent, type):
        ours = parent.__module__.partition(".")[0] == "parenting"
        call = f"pt.{parent.__name__}" if ours else parent.__name__
        raise ValueError(f"parent: {parent.__name__} is a class, not a parent. Call it: parent={call}().")
    if not all(hasattr(parent, verb) for verb in ("events", "take", "post")):
        raise ValueError(
            f"parent: {parent!r} is not a parent. Give an instance of pt.ScriptedParent or of your own"
            ' subclass of parenting.Parent; train also takes a text such as "noisy:0.1" and pt.Person().'
        )
    return parent  # type: ignore[return-value]  # it has the verbs


def check_callback(callback: object) -> None:
    """Refuse a callback that cannot be called.

    Raises:
        TypeError: the message names what was given.
    """
    if callback is not None and not callable(callback):
        raise TypeError(f"callback: {callback!r} is not a function. Give one that takes a pt.Progress.")


def check_progress(progress: object) -> None:
    """Refuse a wish for a progress bar that is not True, False or None.

    Raises:
        TypeError: the message names what was given.
    """
    if progress is not None and not isinstance(progress, bool):
        raise TypeError(
            f"progress: {progress!r} is not True, False or None (a bar only where there is a terminal)."
        )


def path_of(name: str, value: object) -> Path:
    """Return a path from text or a path.

    Raises:
        TypeError: the value is neither; the message names the argument.
    """
    if not isinstance(value, str | Path):
        raise TypeError(f"{name}: {value!r} is not the path of a file or folder. Give a text or a Path.")
    return Path(value)
