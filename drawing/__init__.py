"""Boards as pictures: what a clip or a level shows, as SVG. Needs neither server nor torch."""
