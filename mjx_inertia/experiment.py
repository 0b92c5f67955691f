"""Runs a script of `experiments/` as a Hydra program: its options, its run folder, its result.

In: the command line. Out: what `main` takes, and what it returns, as `result.json` in the run
folder and as the last line of the output. Scripts never see a `DictConfig`.
"""

import contextlib
import dataclasses
import functools
import json
import math
import os
import platform
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from hydra.core.config_store import ConfigStore
from omegaconf import DictConfig, OmegaConf

from mjx_inertia import runtime
from mjx_inertia.dataset import provenance
from mjx_inertia.evaluation import Section, TargetSummary, summarize_all
from mjx_inertia.program import run_program
from mjx_inertia.settings import SweepSettings, register_defaults
from mjx_inertia.sweep import SweepResult, run_sweep, settings_of_job, write_outputs

Result = dict[str, Any]
# Adds figures to the report and entries to the result.
Extra = Callable[[SweepSettings, SweepResult, Path], tuple[tuple[Section, ...], Result]]
Options = TypeVar("Options")

EXPECTED = {
    int: "a whole number that is not negative",
    float: "a finite number",
    str: "text that is not empty",
    NoneType: "null",
}
HELP = """${hydra.help.header}

Options, to be given as name=value; lists as name=[a,b]; -m name=a,b runs both:

$CONFIG
"""


def experiment(
    *kinds: type, prefix: str = ""
) -> Callable[[Callable[..., Result]], Callable[[], None]]:
    """Makes a script's `main` a Hydra program that is named as its file.

    `main` takes one record of each kind and the run folder (`outputs/experiments/<name>` unless
    `hydra.run.dir` is given), and returns the result. The configuration is the defaults of the
    kinds, `configs/experiment/<name>.yaml` over them, and the command line over both.

    Args:
      kinds: `SweepSettings`, whose configuration is that of the main job, or a frozen dataclass of
        options, all of which have defaults; see `options_from`.
      prefix: the name under which the options stand, as in `identify.pushes=480`.
    """

    def decorate(main: Callable[..., Result]) -> Callable[[], None]:
        file = Path(main.__code__.co_filename)

        @functools.wraps(main)
        def program() -> None:
            _register(file.stem, kinds, prefix, main.__globals__["__doc__"])

            def work(records: list[Any], folder: Path) -> None:
                publish(folder, main(*records, folder))

            run_program(file.stem, lambda config: _records(config, kinds, prefix), work)

        return program

    return decorate


def _register(name: str, kinds: tuple[type, ...], prefix: str, document: str) -> None:
    """Makes the program's configuration and its defaults known to Hydra."""
    register_defaults()
    base = (
        ["sweep", {"override experiment": name}]
        if SweepSettings in kinds
        else [{"experiment": name}]
    )
    store = ConfigStore.instance()
    store.store(name=f"{name}_options", node=_defaults(kinds, prefix))
    store.store(
        name=name,
        node={
            "defaults": [f"{name}_options", *base, "_self_"],
            "hydra": {
                "job": {"name": name, "chdir": False},
                "run": {"dir": f"outputs/experiments/{name}"},
                "sweep": {"dir": f"multirun/{name}/${{now:%Y-%m-%d_%H-%M-%S}}"},
                # JAX and MJX say at INFO which devices they looked for
                "job_logging": {
                    "root": {"level": "WARNING"},
                    # the last line of the output is the result
                    "handlers": {"console": {"stream": "ext://sys.stderr"}},
                },
                "help": {"header": document.strip(), "template": HELP},
            },
        },
    )


def _defaults(kinds: tuple[type, ...], prefix: str) -> dict[str, Any]:
    """The options with their defaults, as they stand in the configuration."""
    options = {
        field.name: field.default
        for kind in kinds
        if kind is not SweepSettings
        for field in dataclasses.fields(kind)
    }
    return {prefix: options} if prefix else options


def _records(config: DictConfig, kinds: tuple[type, ...], prefix: str) -> list[Any]:
    """A record of each kind from the composed configuration."""
    raw = OmegaConf.to_container(config, resolve=True)
    assert isinstance(raw, dict)
    known = _defaults(kinds, prefix)
    if SweepSettings not in kinds and (unknown := [key for key in raw if key not in known]):
        raise ValueError(f"{unknown[0]}: no such option; there are {list(known)}")
    records: list[Any] = []
    for kind in kinds:
        if kind is SweepSettings:
            records.append(settings_of_job(config, known))
        else:
            records.append(options_from(kind, raw[prefix] if prefix else raw, prefix))
    return records


def options_from(
    kind: Callable[..., Options], given: Mapping[Any, Any], prefix: str = ""
) -> Options:
    """Options with the values of a configuration.

    Args:
      kind: a frozen dataclass whose fields have defaults. Whole numbers are not negative, floats
        are finite, text and tuples (of text or of a `Literal`) are not empty; for a tuple one value
        may stand.
      given: values by name.
      prefix: of the names in messages.

    Raises:
      ValueError: an unknown name, or a value that its field does not take.
    """
    hints = get_type_hints(kind)
    defaults = {f.name: f.default for f in dataclasses.fields(kind)}  # type: ignore[arg-type]
    path = f"{prefix}." if prefix else ""
    if unknown := sorted(set(given) - set(defaults)):
        raise ValueError(f"{path}{unknown[0]}: no such option; there are {list(defaults)}")
    values = {}
    for name, value in given.items():
        try:
            values[name] = _value(value, hints[name])
        except ValueError as error:
            raise ValueError(f"{path}{name}={error}") from None
    return kind(**values)


def _value(value: Any, kind: Any) -> Any:
    """A value as its field takes it, or the `ValueError` that says what is expected."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is tuple:
        return _values(value if isinstance(value, list) else [value], parts[0])
    if origin in (Union, UnionType):
        for part in parts:
            with contextlib.suppress(ValueError):
                return _value(value, part)
    if (origin is Literal and value in parts) or (kind is NoneType and value is None):
        return value
    if kind is int and type(value) is int and value >= 0:
        return value
    if kind is float and type(value) in (int, float) and math.isfinite(value):
        return float(value)
    if kind is str and type(value) in (str, int, float) and value != "":
        return str(value)
    raise ValueError(f"{value}: expected {_expected(kind)}")


def _values(values: list[Any], kind: Any) -> tuple[Any, ...]:
    choices = get_args(kind)
    if choices and (unknown := [v for v in values if v not in choices]):
        raise ValueError(f"{unknown}: expected some of {list(choices)}")
    if not values:
        raise ValueError(f"{values}: expected a list that is not empty")
    return tuple(_value(v, kind) for v in values)


def _expected(kind: Any) -> str:
    parts = get_args(kind)
    if get_origin(kind) is Literal:
        return f"one of {list(parts)}"
    return " or ".join(map(_expected, parts)) if parts else EXPECTED[kind]


def publish(folder: Path, result: Result) -> None:
    """Prints machine and versions, then the result on one line, which the run folder keeps."""
    line = json.dumps(result)
    (folder / "result.json").write_text(line + "\n")
    print(platform.processor() or platform.machine(), os.cpu_count(), "cores", provenance())
    print(line, flush=True)


def sweep_result(
    name: str, settings: SweepSettings, folder: Path, extra: Extra | None = None
) -> Result:
    """Runs the main job, writes its table and report, and adds up what it found.

    Args:
      name: of the experiment.
      settings: of the job.
      folder: of the run.
      extra: what this experiment adds to the report and to the result.
    """
    start = time.perf_counter()
    runtime.configure(settings.devices)
    found = run_sweep(settings)
    if found is None:
        raise ValueError("the store lacks other shards; run without dataset.shard")
    write_outputs(folder, found, settings.config_yaml)  # kept whatever becomes of the extra
    sections, entries = extra(settings, found, folder) if extra else ((), {})
    print(write_outputs(folder, found, settings.config_yaml, sections))
    for note in found.source.notes:
        print(note)
    print(f"report: {folder / 'report.html'}")
    seconds = round(time.perf_counter() - start, 1)
    rows = {_key(s): _numbers(s) for s in summarize_all(found.evaluations)}
    return {"experiment": name, "seconds": seconds, **entries, **rows}


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
