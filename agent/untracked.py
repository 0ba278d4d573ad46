"""Operations past autograd: a single agent's are so small that autograd's look at each is a sixth of a tick.

`agent.backpropagation` writes the gradient out, so a step needs no graph. `torch.no_grad` builds none, but
each operation still passes through autograd's layer of the dispatcher. `torch.inference_mode` leaves that
layer out, but marks the tensors that it makes, and nobody may train or change them afterwards. This leaves it
out and marks nothing.
"""

from __future__ import annotations

from torch import _C

_AUTOGRAD = _C.DispatchKeySet(_C.DispatchKey.AutogradCPU).add(_C.DispatchKey.ADInplaceOrView)


def untracked() -> _C._ExcludeDispatchKeyGuard:
    """A context for this thread in which no operation on a CPU's tensors can be differentiated."""
    return _C._ExcludeDispatchKeyGuard(_AUTOGRAD)
