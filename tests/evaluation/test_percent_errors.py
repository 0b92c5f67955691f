import numpy as np
import pytest
from fake_evaluations import fake_evaluation

from mjx_inertia.dataset import PushConditions, PushTruth
from mjx_inertia.estimators import Estimate
from mjx_inertia.evaluation import HeldOutEstimates, percent_difference, relative_error_percent
from mjx_inertia.evaluation.errors import com_error_mm, count_failures, target_errors


def small_evaluation(mean, status=(0, 0, 0, 0), com_y=(0.02, 0.0, -0.0009, -0.02), **extra):
    n = 4
    return HeldOutEstimates(
        dataset="d",
        split="s",
        estimator="e",
        estimate=Estimate(
            mean=np.asarray(mean, float),
            covariance=np.broadcast_to(np.eye(4), (n, 4, 4)),
            status=np.asarray(status),
        ),
        truth=PushTruth(
            mass=np.array([1.0, 2.0, 3.0, 4.0]),
            inertia=np.full(n, 0.01),
            com=np.column_stack([np.full(n, 0.05), com_y]),
        ),
        conditions=PushConditions(*[np.arange(n)] + [np.ones(n)] * 5),
        **extra,
    )


RIGHT = [[m, 0.01, 0.05, y] for m, y in zip((1, 2, 3, 4), (0.02, 0, -0.0009, -0.02), strict=True)]


@pytest.mark.parametrize(
    ("truth", "estimate", "expected"),
    [
        (2.0, 2.0, 0.0),
        (3.0, 1.0, 100.0),  # too small: positive
        (1.0, 3.0, -100.0),
        (-0.02, -0.01, -200 / 3),  # Eq. 3.12 as printed: the sign is that of truth - estimate
        (0.0, 0.5, -200.0),
        (0.0, 0.0, 0.0),
        (1.0, -1.0, 200.0),
    ],
)
def test_percent_difference_by_hand(truth, estimate, expected):
    arrays = np.array([truth]), np.array([estimate])
    np.testing.assert_allclose(percent_difference(*arrays), [expected])


def test_percent_difference_bounds_antisymmetry_and_nan():
    truth, estimate = np.random.default_rng(0).normal(size=(2, 1000))
    signed = percent_difference(truth, estimate)
    assert np.abs(signed).max() <= 200 + 1e-9
    np.testing.assert_allclose(signed, -percent_difference(estimate, truth))
    assert np.isnan(percent_difference(np.array([1.0]), np.array([np.nan]))).all()


def test_relative_error_by_hand():
    truth, estimate = np.array([4.0, -2.0, 0.0, 0.0]), np.array([5.0, -1.0, 1.0, 0.0])
    np.testing.assert_allclose(relative_error_percent(truth, estimate), [25, 50, np.inf, 0])


def test_com_error_is_in_mm_and_signed():
    np.testing.assert_allclose(com_error_mm(np.array([0.05]), np.array([0.048])), [2.0])


def test_small_com_components_are_left_out_of_percent_but_count_in_mm():
    errors = target_errors(small_evaluation(RIGHT), "com_y")
    assert errors.left_out.tolist() == [False, True, True, False]
    assert np.isnan(errors.signed_percent).tolist() == [False, True, True, False]
    np.testing.assert_allclose(errors.signed_mm, 0.0, atol=1e-12)
    assert not target_errors(small_evaluation(RIGHT), "com_x").left_out.any()


def test_failures_are_never_errors():
    mean = np.array(RIGHT)
    mean[1] = np.nan  # says so in its status
    mean[2, 0] = np.inf  # does not say so
    evaluation = small_evaluation(mean, status=(0, 1, 0, 0), push_status=np.array([0, 1, 0, 0]))
    mass, inertia = target_errors(evaluation, "mass"), target_errors(evaluation, "inertia")
    assert mass.failed.tolist() == [False, True, True, False]
    assert inertia.failed.tolist() == [False, True, False, False]
    assert mass.used.tolist() == [True, False, False, True]
    assert count_failures(evaluation) == {"LOST_CONTACT": 1, "NOT_FINITE": 1}


def test_failure_reasons_without_push_status_and_of_unknown_number():
    evaluation = small_evaluation(RIGHT, status=(1, 1, 9, 0))
    assert count_failures(evaluation) == {"BAD_INPUT": 2, "EstimateStatus 9": 1}


def test_unknown_truth_is_left_out():
    evaluation = small_evaluation(RIGHT)
    evaluation.truth.mass[0] = np.nan
    assert target_errors(evaluation, "mass").left_out.tolist() == [True, False, False, False]


def test_misuse_is_named():
    with pytest.raises(ValueError, match="weight"):
        target_errors(fake_evaluation("mean", None), "weight")
    with pytest.raises(ValueError, match="same number of rows"):
        small_evaluation(RIGHT[:3])
