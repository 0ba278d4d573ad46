"""Worlds given by tables of transition probabilities, as Gymnasium's toy text gives them."""
