"""All speeds that this package claims, each against its rival in the same run: one table.

    pip install -e ".[test,rival]"
    python experiments/speed.py [parts=[throughput,sysid,grasps,space,mass_properties]]

Runs the five benchmarks one after the other, each in a process of its own, because they need
different precisions and numbers of devices. Within each, package and rival alternate, and
compilation is timed apart. Some 10 minutes on 2 free cores. A benchmark that fails leaves its ratio
empty and the others as they are; the script then ends with status 1.
"""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from mjx_inertia import runtime
from mjx_inertia.experiment import experiment, publish

HERE = Path(__file__).parent
Found = Mapping[str, Any]
Part = Literal["throughput", "sysid", "grasps", "space", "mass_properties"]


@dataclass(frozen=True)
class Benchmark:
    """A script of this folder and how its JSON line is read."""

    title: str
    command: tuple[str, ...]  # script and options
    rival: str
    key: str  # of the ratio in the JSON line of this script
    ratio: Callable[[Found], float]
    ours: Callable[[Found], str]  # with unit
    theirs: Callable[[Found], str]


BENCHMARKS: dict[Part, Benchmark] = {
    "throughput": Benchmark(
        "simulated pushes",
        ("throughput.py",),
        "mujoco.batch",
        "throughput_ratio",
        lambda f: f["ratio"],
        lambda f: f"{f['pushes_per_s']:,.0f} pushes/s",
        lambda f: f"{f['rival_pushes_per_s']:,.0f} pushes/s",
    ),
    "sysid": Benchmark(
        "identified pushes",
        ("sysid_rival.py", "pushes=512", "rival_pushes=16"),
        "mujoco.sysid",
        "sysid_ratio",
        lambda f: f["ratio"],
        lambda f: f"{f['ours_pushes_per_s']:.1f} pushes/s",
        lambda f: f"{f['rival_pushes_per_s']:.2f} pushes/s",
    ),
    "grasps": Benchmark(
        "metrics of 10,000 grasps × 50 waypoints",
        ("grasp_speed.py",),
        "Pinocchio",
        "grasp_ratio",
        lambda f: f["ratio"],
        lambda f: f"{f['ours_s']:.3f} s",
        lambda f: f"{f['rival_s']:.3f} s",
    ),
    "space": Benchmark(
        "nine objectives of a manoeuvre, 32 nodes",
        ("space_speed.py",),
        "NumPy, same nodes",
        "space_ratio",
        lambda f: f["ratio_same_nodes_alone"],
        lambda f: f"{f['ours_alone_evaluations_per_s']:,.0f}/s",
        lambda f: f"{f['rival_same_nodes_alone_evaluations_per_s']:,.0f}/s",
    ),
    "mass_properties": Benchmark(
        "mass properties of unlike meshes",
        ("mass_properties.py",),
        "trimesh",
        "mass_properties_ratio",
        lambda f: f["ratio"],
        lambda f: f"{f['ours_meshes_per_s']:,.0f} meshes/s",
        lambda f: f"{f['trimesh_meshes_per_s']:,.0f} meshes/s",
    ),
}


@dataclass(frozen=True)
class Options:
    """Command-line options."""

    parts: tuple[Part, ...] = get_args(Part)


def run(benchmark: Benchmark) -> Found | None:
    """The JSON line of a benchmark; None, and its errors on stderr, if it failed."""
    script, *options = benchmark.command
    done = subprocess.run(
        [sys.executable, str(HERE / script), *options],
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    try:
        if done.returncode == 0:
            return json.loads(done.stdout.strip().splitlines()[-1])
    except (IndexError, json.JSONDecodeError):
        pass
    print(f"{script} failed with status {done.returncode}", file=sys.stderr)
    return None


def planning_seconds(grasps: Found) -> float:
    """Planning and judging 10,000 grasps, in float64, compilation excluded."""
    return round(grasps["planning_s"] + grasps["ours_s"], 2)


def row(benchmark: Benchmark, found: Found) -> str:
    """A line of the table."""
    cells = (
        benchmark.title,
        benchmark.ours(found),
        f"{benchmark.rival}: {benchmark.theirs(found)}",
        f"{benchmark.ratio(found):.1f}",
        f"{found['compile_s']:.1f} s",
    )
    return "| " + " | ".join(cells) + " |"


@experiment(Options)
def main(options: Options, folder: Path) -> dict[str, Any]:
    """Runs the benchmarks and prints the table."""
    headline: dict[str, float | None] = {b.key: None for b in BENCHMARKS.values()}
    headline["planning_s"] = None
    rows, failed = [], False
    for name in options.parts:
        benchmark = BENCHMARKS[name]
        print(f"{' '.join(benchmark.command)} ...", flush=True)
        found = run(benchmark)
        if found is None:
            failed = True
            continue
        headline[benchmark.key] = benchmark.ratio(found)
        rows.append(row(benchmark, found))
        if name == "grasps":
            headline["planning_s"] = planning_seconds(found)
            planned = f"planning and judging 10,000 grasps | {headline['planning_s']:.2f} s"
            rows.append(f"| {planned} | | | {found['planning_compile_s']:.1f} s |")
    threads = os.environ.get("NPROC") or runtime.cores()
    print(f"{processor()}, {runtime.cores()} cores, {threads} threads in XLA's pool")
    print("| | ours | rival | ratio | compiled in |\n| --- | --- | --- | --- | --- |")
    print("\n".join(rows))
    if failed:
        publish(folder, headline)
        raise SystemExit(1)
    return headline


def processor() -> str:
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
