"""The quality of policies: their argmax, how episodes end, and what they collect."""
