"""Drawings that several experiments share, by what they put onto the axes."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from parenting.experiments.reporting.plots import Proportion, plot_proportions


def test_a_share_has_a_point_and_the_paper_a_bar() -> None:
    figure = Figure(layout="constrained")
    plot_proportions(
        figure,
        [
            Proportion("lax", "pressed", 1, 4, 0.0),
            Proportion("lax", "optimal", 3, 4),
            Proportion("fresh", "pressed", 0, 4),
        ],
    )
    (axes,) = figure.axes
    marked = [one for one in axes.lines if one.get_marker() != "None"]
    points = {(one.get_marker(), *np.ravel(one.get_path().vertices).tolist()) for one in marked}
    assert points == {("o", 25.0, 1.0), ("|", 0.0, 1.0), ("o", 75.0, 2.0), ("o", 0.0, 4.0)}
    named = [label.get_text() for label in axes.get_yticklabels()]
    assert named == ["lax", "pressed", "optimal", "fresh", "pressed"]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["ours", "the paper"]
    interval = np.asarray(axes.lines[0].get_xdata()).tolist()
    assert interval == pytest.approx([4.559, 69.936], abs=0.01)  # Wilson, 1 of 4
