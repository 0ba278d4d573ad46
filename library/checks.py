"""Checks of single arguments, each with a sentence that names the argument, its value and the remedy."""

from __future__ import annotations

import torch


def check_number(name: str, value: object, least: int, most: int) -> None:
    """Refuse an argument that is not a whole number within bounds.

    Raises:
        ValueError: the message names the argument, its value and the bounds.
    """
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
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
