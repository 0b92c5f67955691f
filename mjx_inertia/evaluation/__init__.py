"""Estimates and truths to an honest table, figures and one report."""

from mjx_inertia.evaluation.accuracy_figures import calibration_histograms, predicted_against_true
from mjx_inertia.evaluation.appearance import to_data_uri
from mjx_inertia.evaluation.condition_figures import (
    VariationGroup,
    error_averages,
    error_images,
    errors_by_condition,
    variation_boxes,
)
from mjx_inertia.evaluation.error_breakdown import CONDITIONS, BreakdownRow, breakdown
from mjx_inertia.evaluation.errors import (
    TargetErrors,
    absolute_percent_difference,
    com_error_mm,
    percent_difference,
    relative_error_percent,
    target_errors,
)
from mjx_inertia.evaluation.evaluation import HeldOutEstimates, count_failures
from mjx_inertia.evaluation.fit_figures import FitSignals, draw_fit, fit_signals
from mjx_inertia.evaluation.information_figures import draw_bound_maps, draw_sequences
from mjx_inertia.evaluation.intervals import (
    Calibration,
    Interval,
    bootstrap_mean,
    calibrate,
    z_scores,
)
from mjx_inertia.evaluation.push_figures import sample_signals
from mjx_inertia.evaluation.report import ReportContent, SplitText, render_report, write_report
from mjx_inertia.evaluation.report_figures import Section
from mjx_inertia.evaluation.report_tables import Published
from mjx_inertia.evaluation.summary import (
    TargetSummary,
    leading_estimator,
    summarize,
    summarize_all,
)
from mjx_inertia.evaluation.tables import RESULT_COLUMNS, format_table, write_results
from mjx_inertia.evaluation.tree_figures import draw_tree

__all__ = [
    "CONDITIONS",
    "RESULT_COLUMNS",
    "BreakdownRow",
    "Calibration",
    "FitSignals",
    "HeldOutEstimates",
    "Interval",
    "Published",
    "ReportContent",
    "Section",
    "SplitText",
    "TargetErrors",
    "TargetSummary",
    "VariationGroup",
    "absolute_percent_difference",
    "bootstrap_mean",
    "breakdown",
    "calibrate",
    "calibration_histograms",
    "com_error_mm",
    "count_failures",
    "draw_bound_maps",
    "draw_fit",
    "draw_sequences",
    "draw_tree",
    "error_averages",
    "error_images",
    "errors_by_condition",
    "fit_signals",
    "format_table",
    "leading_estimator",
    "percent_difference",
    "predicted_against_true",
    "relative_error_percent",
    "render_report",
    "sample_signals",
    "summarize",
    "summarize_all",
    "target_errors",
    "to_data_uri",
    "variation_boxes",
    "write_report",
    "write_results",
    "z_scores",
]
