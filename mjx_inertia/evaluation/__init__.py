"""Estimates and truths to an honest table, figures and one report."""

from mjx_inertia.evaluation.accuracy_figures import (
    calibration_histograms as calibration_histograms,
    predicted_against_true as predicted_against_true,
)
from mjx_inertia.evaluation.appearance import to_data_uri as to_data_uri
from mjx_inertia.evaluation.condition_figures import (
    VariationGroup as VariationGroup,
    error_averages as error_averages,
    error_images as error_images,
    errors_by_condition as errors_by_condition,
    variation_boxes as variation_boxes,
)
from mjx_inertia.evaluation.error_breakdown import (
    CONDITIONS as CONDITIONS,
    BreakdownRow as BreakdownRow,
    breakdown as breakdown,
)
from mjx_inertia.evaluation.errors import (
    TargetErrors as TargetErrors,
    absolute_percent_difference as absolute_percent_difference,
    com_error_mm as com_error_mm,
    percent_difference as percent_difference,
    relative_error_percent as relative_error_percent,
    target_errors as target_errors,
)
from mjx_inertia.evaluation.evaluation import (
    HeldOutEstimates as HeldOutEstimates,
    count_failures as count_failures,
)
from mjx_inertia.evaluation.fit_figures import (
    FitSignals as FitSignals,
    draw_fit as draw_fit,
    fit_signals as fit_signals,
)
from mjx_inertia.evaluation.intervals import (
    Calibration as Calibration,
    Interval as Interval,
    bootstrap_mean as bootstrap_mean,
    calibrate as calibrate,
    z_scores as z_scores,
)
from mjx_inertia.evaluation.push_figures import sample_signals as sample_signals
from mjx_inertia.evaluation.report import (
    ReportContent as ReportContent,
    SplitText as SplitText,
    render_report as render_report,
    write_report as write_report,
)
from mjx_inertia.evaluation.report_figures import Section as Section
from mjx_inertia.evaluation.report_tables import Published as Published
from mjx_inertia.evaluation.summary import (
    TargetSummary as TargetSummary,
    leading_estimator as leading_estimator,
    summarize as summarize,
    summarize_all as summarize_all,
)
from mjx_inertia.evaluation.tables import (
    RESULT_COLUMNS as RESULT_COLUMNS,
    format_table as format_table,
    write_results as write_results,
)
from mjx_inertia.evaluation.tree_figures import draw_tree as draw_tree
