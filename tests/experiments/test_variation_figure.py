"""The figure of varied cubes, from made-up errors."""

import numpy as np

from parts.variation_figure import VariationGroup, variation_boxes


def test_variation_boxes_show_every_group():
    rng = np.random.default_rng(0)
    groups = [
        VariationGroup(name, rng.uniform(5, 20, 6), rng.uniform(5, 40, 6))
        for name in ("size ±30 %", "mass ±30 %", "friction ±30 %")
    ]
    axes = variation_boxes(groups).axes[0]
    assert [t.get_text() for t in axes.get_xticklabels()] == [g.name for g in groups]
