"""How well a policy does: what its argmax does, how it ends, what it collects."""
