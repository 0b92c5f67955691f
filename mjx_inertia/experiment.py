"""What the scripts of `experiments/` share: run a configured job, write its report, its headline.

In: the name of a file in `configs/experiment/` and overrides. Out: the result, and on the last line
of the output one JSON object.
"""

import json
import platform
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mjx_inertia import runtime
from mjx_inertia.dataset import provenance
from mjx_inertia.evaluation import Section, TargetSummary, summarize_all
from mjx_inertia.settings import SweepSettings, compose
from mjx_inertia.sweep import SweepResult, run_sweep, write_outputs

# Adds figures to the report and entries to the headline.
Extra = Callable[[SweepSettings, SweepResult, Path], tuple[tuple[Section, ...], dict[str, Any]]]


def run_experiment(name: str, overrides: Sequence[str], extra: Extra | None = None) -> None:
    """Runs `configs/experiment/<name>.yaml`; writes to `outputs/experiments/<name>`.

    Args:
      name: of the experiment.
      overrides: of its configuration, as on the command line.
      extra: what this experiment adds to the main job.
    """
    start = time.perf_counter()
    folder = Path("outputs/experiments") / name
    try:
        settings, text = compose([f"experiment={name}", *overrides])
        runtime.configure(settings.devices)
        result = run_sweep(settings)
        if result is None:
            raise ValueError("the store lacks other shards; run without dataset.shard")
        write_outputs(folder, result, text)  # kept whatever becomes of the extra
        sections, entries = extra(settings, result, folder) if extra else ((), {})
    except (ValueError, RuntimeError, FileNotFoundError) as error:
        raise SystemExit(f"error: {error}") from None
    print(write_outputs(folder, result, text, sections))
    for note in result.source.notes:
        print(note)
    print(f"report: {folder / 'report.html'}")
    print(platform.processor() or platform.machine(), provenance())
    seconds = round(time.perf_counter() - start, 1)
    rows = {_key(s): _numbers(s) for s in summarize_all(result.evaluations)}
    print(json.dumps({"experiment": name, "seconds": seconds, **entries, **rows}))


def _key(s: TargetSummary) -> str:
    return f"{s.split}.{s.estimator}.{s.target}"


def _numbers(s: TargetSummary) -> dict[str, float | int]:
    numbers: dict[str, float | int] = {
        "n": s.n,
        "failed": s.failed,
        "signed_mean_percent": round(s.signed_mean_percent, 2),
        "signed_std_percent": round(s.signed_std_percent, 2),
        "abs_mean_percent": round(s.abs_percent.mean, 2),
        "abs_median_percent": round(s.abs_median_percent, 2),
    }
    return numbers if s.abs_mm is None else {**numbers, "abs_mean_mm": round(s.abs_mm.mean, 3)}
