import warnings

import matplotlib as mpl
import numpy as np
import pytest
from fake_evaluations import fake_evaluation, fake_evaluations, fake_records
from matplotlib.figure import Figure

from mjx_inertia.estimators import TreeNode
from mjx_inertia.evaluation import (
    draw_tree,
    error_averages,
    error_images,
    sample_signals,
    to_data_uri,
)
from mjx_inertia.evaluation.condition_figures import errors_by_condition
from mjx_inertia.evaluation.report_figures import calibration_histograms, predicted_against_true

TREE = [
    TreeNode("f_x mean", 4.2, 1, 2, None),
    TreeNode(None, None, None, None, (1.0, 0.002)),
    TreeNode("m std", 0.01, 3, 4, None),
    TreeNode(None, None, None, None, (2.5, 0.008)),
    TreeNode(None, None, None, None, (3.5, 0.012)),
]


def texts(figure):
    return [t.get_text() for axes in figure.axes for t in axes.texts]


@pytest.fixture(autouse=True)
def strict():
    """No warning is shown to a reader, and no global state of matplotlib changes."""
    before = dict(mpl.rcParams)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield
    assert dict(mpl.rcParams) == before


def draw_all(evaluation, baseline):
    return [
        predicted_against_true([evaluation]),
        errors_by_condition(evaluation, "friction", baseline),
        error_images(evaluation, max_objects=5),
        error_averages(evaluation),
        calibration_histograms(evaluation),
    ]


def test_figures_are_drawn_and_become_part_of_a_page():
    baseline, forest, _ = fake_evaluations(pushes=200)[:3]
    for figure in draw_all(forest, baseline):
        assert isinstance(figure, Figure)
        assert to_data_uri(figure).startswith("data:image/svg+xml;base64,")


def test_figures_survive_an_estimator_that_always_fails():
    failed = fake_evaluation("broken", 0.1, pushes=20, failed=20)
    for figure in draw_all(failed, failed):
        figure.draw_without_rendering()


def test_every_axis_has_its_unit():
    evaluation = fake_evaluation("e", 0.1)
    labels = [axes.get_xlabel() for axes in predicted_against_true([evaluation]).axes]
    assert labels == [
        "true mass, kg",
        "true $I_{zz}$, 10⁻³ kg m²",
        "true CoM x, mm",
        "true CoM y, mm",
    ]


def test_estimates_beyond_the_axes_are_counted():
    evaluation = fake_evaluation("e", 0.01)
    evaluation.estimate.mean[0, 0] = 100.0
    assert "1 beyond (×)" in texts(predicted_against_true([evaluation]))[0]


def test_error_images_show_the_errors():
    evaluation = fake_evaluation("e", 0.0)
    evaluation.estimate.mean[:, 0] *= 1.25
    figure = error_images(evaluation, max_objects=5)
    image = figure.axes[0].images[0].get_array()
    assert image.shape == (5, 5)
    np.testing.assert_allclose(image.compressed(), 25.0)


def test_signals_stop_where_the_push_does():
    records = fake_records(pushes=3, samples=100)
    figure = sample_signals(records, [0, 2])
    assert [len(line.get_xdata()) for line in figure.axes[0].lines] == [50, 100]
    assert len(figure.axes) == 8
    with pytest.raises(ValueError, match="pushes"):
        sample_signals(records, [])


def test_tree_is_drawn_to_its_depth():
    whole = texts(draw_tree(TREE, ["m {:.1f} kg", "I {:.3f} kg m²"]))
    assert "f_x mean\n< 4.2" in whole
    assert "m 3.5 kg\nI 0.012 kg m²" in whole
    cut = texts(draw_tree(TREE, max_depth=1))
    assert "…" in cut
    with pytest.raises(ValueError, match="child"):
        draw_tree([TreeNode("f", 1.0, 0, 1, None), TreeNode(None, None, None, None, (1.0,))])
    with pytest.raises(ValueError, match="empty"):
        draw_tree([])


def test_equal_figures_have_equal_bytes():
    assert to_data_uri(draw_tree(TREE)) == to_data_uri(draw_tree(TREE))
