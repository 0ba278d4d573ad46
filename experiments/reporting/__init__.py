"""Rows to comparisons with the paper, and those to pages: statistics, plots, Markdown, HTML."""
