"""Boards as SVG: levels, clips, queries and policies. Needs levels and Jinja, neither server nor torch."""
