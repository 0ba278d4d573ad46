"""What the paper compares with: REINFORCE, which learns from reward."""
