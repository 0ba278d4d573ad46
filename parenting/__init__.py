"""Safe reinforcement learning from a parent's guidance and preferences, without a reward signal."""
