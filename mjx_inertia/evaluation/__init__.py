"""Estimates and truths to an honest table, figures and one report."""

from mjx_inertia.evaluation.appearance import to_data_uri as to_data_uri
from mjx_inertia.evaluation.condition_figures import (
    error_averages as error_averages,
    error_images as error_images,
)
from mjx_inertia.evaluation.errors import (
    HeldOutEstimates as HeldOutEstimates,
    percent_difference as percent_difference,
    relative_error_percent as relative_error_percent,
)
from mjx_inertia.evaluation.push_figures import (
    draw_fit as draw_fit,
    fit_signals as fit_signals,
    sample_signals as sample_signals,
)
from mjx_inertia.evaluation.report import (
    Published as Published,
    ReportContent as ReportContent,
    SplitText as SplitText,
    write_report as write_report,
)
from mjx_inertia.evaluation.report_figures import Section as Section, draw_tree as draw_tree
from mjx_inertia.evaluation.summary import (
    TargetSummary as TargetSummary,
    format_table as format_table,
    summarize_all as summarize_all,
    write_results as write_results,
)
