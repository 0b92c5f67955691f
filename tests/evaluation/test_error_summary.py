import csv
import io

import numpy as np
import pytest
from fake_evaluations import fake_evaluation, fake_evaluations

from mjx_inertia.estimators import TARGETS
from mjx_inertia.evaluation import format_table, summarize_all, write_results
from mjx_inertia.evaluation.condition_figures import breakdown
from mjx_inertia.evaluation.summary import (
    RESULT_COLUMNS,
    bootstrap_mean,
    calibrate,
    leading_estimator,
    summarize,
    z_scores,
)


def test_summary_is_what_numpy_says():
    evaluation = fake_evaluation("boosted", 0.05, failed=5)
    rows = summarize(evaluation)
    assert tuple(row.target for row in rows) == TARGETS
    ok = np.arange(5, 480)
    truth, estimate = evaluation.truth.mass[ok], evaluation.estimate.mean[ok, 0]
    signed = 200 * (truth - estimate) / (truth + estimate)
    mass, _, _, com_y = rows
    assert (mass.n, mass.failed, mass.left_out, mass.pushes) == (475, 5, 0, 480)
    np.testing.assert_allclose(
        [
            mass.signed_mean_percent,
            mass.signed_std_percent,
            mass.abs_mean_percent,
            mass.abs_median_percent,
        ],
        [signed.mean(), signed.std(), np.abs(signed).mean(), np.median(np.abs(signed))],
    )
    true_y, y = evaluation.truth.com[ok, 1], evaluation.estimate.mean[ok, 3]
    assert com_y.left_out == np.sum(np.abs(true_y) < 1e-3) > 0
    assert com_y.n + com_y.left_out + com_y.failed == com_y.pushes
    np.testing.assert_allclose(com_y.abs_mm.mean, 1e3 * np.abs(true_y - y).mean())


def test_summary_of_nothing_but_failures():
    for row in summarize(fake_evaluation("broken", 0.1, pushes=20, failed=20)):
        assert (row.n, row.failed) == (0, 20)
        assert np.isnan([row.abs_mean_percent, row.signed_mean_percent, row.headline.low]).all()


def test_bootstrap_interval_covers_the_mean():
    """Errors of an object are alike: intervals over objects cover, over rows they do not."""
    rng = np.random.default_rng(1)
    groups = np.repeat(np.arange(60), 8)
    by_object, by_row = 0, 0
    for trial in range(200):
        values = 10 + rng.normal(size=60)[groups] + 0.5 * rng.normal(size=groups.size)
        interval = bootstrap_mean(values, groups, seed=trial, resamples=300)
        by_object += interval.low <= 10 <= interval.high
        interval = bootstrap_mean(values, np.arange(groups.size), seed=trial, resamples=300)
        by_row += interval.low <= 10 <= interval.high
    assert 0.9 <= by_object / 200 <= 0.99
    assert by_row / 200 < 0.7


def test_bootstrap_is_seeded_and_matches_the_normal_interval():
    values = np.random.default_rng(0).normal(5, 2, size=2000)
    first = bootstrap_mean(values, np.arange(2000), seed=3)
    assert first == bootstrap_mean(values, np.arange(2000), seed=3)
    assert first != bootstrap_mean(values, np.arange(2000), seed=4)
    half = 1.96 * values.std() / np.sqrt(2000)
    assert first.mean == pytest.approx(values.mean())
    assert (first.high - first.low) / 2 == pytest.approx(half, rel=0.1)


def test_bootstrap_of_one_object_draws_rows_and_of_nothing_is_nan():
    interval = bootstrap_mean(np.array([1.0, 2.0, 3.0]), np.zeros(3, int), seed=0)
    assert interval.low < interval.mean < interval.high
    assert np.isnan(bootstrap_mean(np.empty(0), np.empty(0, int), seed=0).mean)


@pytest.mark.parametrize("claimed", [0.5, 1.0, 2.0])
def test_calibration_sees_over_and_underconfidence(claimed):
    evaluation = fake_evaluation("e", 0.05, pushes=4800, claimed=claimed)
    for row in summarize(evaluation):
        assert row.calibration.z_rms == pytest.approx(claimed, rel=0.05)
        assert row.calibration.n == 4800
        if claimed == 1.0:
            assert row.calibration.coverage_68 == pytest.approx(0.683, abs=0.03)
            assert row.calibration.coverage_95 == pytest.approx(0.95, abs=0.015)


def test_z_scores_leave_out_what_has_no_sigma():
    sigma = np.array([1.0, 2.0, 0.0, np.inf, np.nan])
    z = z_scores(np.ones(5), np.zeros(5), sigma)
    np.testing.assert_allclose(z, [1.0, 0.5])
    assert calibrate(np.empty(0)).n == 0


def test_breakdown_parts_add_up_to_the_whole():
    evaluation = fake_evaluation("e", 0.1, failed=4)
    whole = {row.target: row for row in summarize(evaluation)}
    for condition, levels in [("friction", 6), ("size", 4), ("speed", 4), ("contact_offset", 5)]:
        for target in TARGETS:
            rows = breakdown(evaluation, condition, target)
            assert len(rows) == levels
            assert [r.level for r in rows] == sorted(r.level for r in rows)
            assert sum(r.n for r in rows) == whole[target].n
            assert sum(r.failed for r in rows) == 4
            total = sum(r.n * r.abs_mean_percent for r in rows if r.n)
            assert total / whole[target].n == pytest.approx(whole[target].abs_mean_percent)
    assert next(row.label for row in breakdown(evaluation, "speed", "mass")) == "0.01"
    assert len(breakdown(evaluation, "mass", "mass")) == 8  # 20 masses in bins
    with pytest.raises(ValueError, match="colour"):
        breakdown(evaluation, "colour", "mass")


def test_breakdown_of_unknown_condition_values_is_empty():
    evaluation = fake_evaluation("e", 0.1)
    evaluation.conditions.friction[:] = np.nan
    assert breakdown(evaluation, "friction", "mass") == ()


def test_results_csv_has_the_columns_of_the_contract_and_reads_back(tmp_path):
    summaries = summarize_all(fake_evaluations(pushes=200))
    path = tmp_path / "results.csv"
    path.write_text("an older file")
    write_results(path, summaries)
    text = path.read_text()
    assert text.splitlines()[0] == (
        "dataset,split,estimator,target,n,failed,signed_mean_percent,signed_std_percent,"
        "abs_mean_percent,abs_median_percent"
    )
    rows = list(csv.DictReader(io.StringIO(text)))
    assert tuple(rows[0]) == RESULT_COLUMNS
    assert len(rows) == len(summaries) == 2 * 3 * 4
    for row, summary in zip(rows, summaries, strict=True):
        assert row["target"] in TARGETS
        assert (int(row["n"]), int(row["failed"])) == (summary.n, summary.failed)
        for column in RESULT_COLUMNS[6:]:
            assert float(row[column]) == pytest.approx(getattr(summary, column), rel=1e-5)
    assert [p.name for p in tmp_path.iterdir()] == ["results.csv"]


def test_results_csv_needs_its_folder(tmp_path):
    with pytest.raises(FileNotFoundError, match="existing folder"):
        write_results(tmp_path / "no" / "results.csv", summarize(fake_evaluation("e", 0.1)))


def test_terminal_table_puts_the_baseline_first_and_marks_the_best():
    summaries = summarize_all(fake_evaluations()[::-1])
    lines = format_table(summaries).splitlines()
    assert "grouped: 480 pushes of 60 objects" in lines[0]
    assert "CoM x mm" in lines[1]
    assert "I_zz %" in lines[1]
    assert lines[2].split()[:2] == ["mean", "(baseline)"]
    boosted = next(line for line in lines if line.split()[:1] == ["boosted"])
    assert boosted.count("*") == 4
    assert max(map(len, lines)) < 120
    assert leading_estimator([s for s in summaries if s.split == "thesis"], "mean") == "boosted"
