"""The paper's baseline: REINFORCE, which learns from reward."""
