"""What the scripts of `experiments/` share: their options; a configured job, its report, headline.

In: the command line, or the name of a file in `configs/experiment/` and overrides. Out: a record of
options, or the result, and on the last line of the output one JSON object.
"""

import json
import math
import platform
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from mjx_inertia import runtime
from mjx_inertia.dataset import provenance
from mjx_inertia.evaluation import Section, TargetSummary, summarize_all
from mjx_inertia.settings import SweepSettings, compose
from mjx_inertia.sweep import SweepResult, run_sweep, write_outputs

# Adds figures to the report and entries to the headline.
Extra = Callable[[SweepSettings, SweepResult, Path], tuple[tuple[Section, ...], dict[str, Any]]]

Options = TypeVar("Options")


def read_options(
    kind: Callable[..., Options], arguments: Sequence[str], prefix: str = ""
) -> Options:
    """A script's options, each given as `name=value`.

    Args:
      kind: a frozen dataclass whose fields have defaults: whole numbers, which are never negative,
        floats, strings, or tuples of strings, given with commas between them.
      arguments: of the command line.
      prefix: of every name, as in `identify.pushes=480`; may be left out.

    Raises:
      SystemExit: an unknown name, or a value that is not what its default is.
    """
    defaults = vars(kind())
    given = {}
    for argument in arguments:
        name, _, text = argument.removeprefix(prefix).partition("=")
        if name not in defaults:
            known = ", ".join(f"{prefix}{n}={_text(v)}" for n, v in defaults.items())
            raise SystemExit(f"error: {argument}: expected some of {known}")
        try:
            given[name] = _value(text, defaults[name])
        except ValueError as error:
            raise SystemExit(f"error: {argument}: expected {error}") from None
    return kind(**given)


def _value(text: str, default: Any) -> int | float | str | tuple[str, ...]:
    """`text` as the type of a default, or the `ValueError` that says what is expected."""
    if isinstance(default, int):
        if not text.isdecimal():
            raise ValueError(f"a whole number that is not negative, as {default}")
        return int(text)
    if isinstance(default, float):
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise ValueError(f"a finite number, as {default}")
        return number
    words = tuple(text.split(",")) if isinstance(default, tuple) else (text,)
    if not all(words):
        raise ValueError("no empty value")
    return words if isinstance(default, tuple) else text


def _text(value: Any) -> str:
    return ",".join(value) if isinstance(value, tuple) else str(value)


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
