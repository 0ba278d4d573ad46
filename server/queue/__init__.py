"""The queue between worker and browser: its two sides, and the parent that stands behind it."""
